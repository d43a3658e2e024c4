"""Random numbers that depend only on their key, and the samplers of directions that the handouts name.

A number is a hash of (seed, pixel, sample index, dimension). It is the same on every run, with every number of threads
and on every backend, and any range of samples can be rendered on any machine. In a kernel,
``rng = sampler.start(seed, x, y, index)`` begins the numbers of one sample. Each ``rng.next_2d()`` or ``rng.next_1d()``
takes the numbers of the next dimension. The number of dimensions has no limit. The first pair of every sample belongs
to the pixel (A2-1); then every surface takes one pair for its BRDF and one pair for the light.
"""

import copy
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.brdfs.base import Brdf, eval_over_pdf
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.phong import Phong
from taichi_tracer.formulas.area_lights import uniform_triangle
from taichi_tracer.formulas.finite_fields import first_pair, second_pair
from taichi_tracer.formulas.hashes import as_fraction, pascal_matrix, pcg4d, reverse_bits, scramble_reversed
from taichi_tracer.formulas.spheres import widened
from taichi_tracer.formulas.warps import uniform_sphere
from taichi_tracer.lights.choice import LampChoice, LampTable
from taichi_tracer.system import memory
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import register
from taichi_tracer.system.seams import called, in_kernels, replaced, seams

DEFAULT_SAMPLER = "niederreiter"
TERM_BIT = 16  # dimensions are counted in the bits below, terms that share a dimension in the bits above


class RandomNumbers:
    """The numbers of one sample of one pixel, inside a kernel; ``Sampler.start`` returns them.

    Attributes:
        x, y: the pixel. index: the index of the sample.
        dimension: how many dimensions were taken so far.
        terms: how many pairs of ``next_2d_of_term`` share a dimension with another pair.
    """

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions
    _begun_last: tuple | None = None  # (the kernel that is being compiled, its numbers)

    def __init__(self, sampler: "Sampler", seed, x, y, index) -> None:
        self.sampler, self.seed, self.x, self.y, self.index = sampler, seed, x, y, index
        self.dimension, self.terms = impl.expr_init(0), impl.expr_init(0)
        self.pixel = impl.expr_init(sampler.pixel_number(x, y))
        RandomNumbers._begun_last = impl.get_runtime().compiling_callable, self

    @classmethod
    def of_this_kernel(cls) -> "RandomNumbers | None":
        """The numbers that were begun in the kernel that is being compiled now; None if there are none."""
        begun = cls._begun_last
        return begun[1] if begun is not None and begun[0] is impl.get_runtime().compiling_callable else None

    @ti.func
    def next_2d(self):
        """Two numbers in [0, 1)."""
        dimension = ti.u32(self.dimension)
        self.dimension += 1
        return self.sampler.get_2d(self.seed, self.pixel, self.index, dimension)

    @ti.func
    def next_2d_of_term(self):
        """Two numbers in [0, 1) for a term that is **added** to what later numbers decide, as the light's sample is.

        At a surface, the sample of the light and that of the BRDF are added, and never multiplied with each other. A
        sampler that ``shares_terms`` takes the pair from the dimension of the next ``next_2d``, so that both are
        distributed evenly together with the numbers before them. The pair is independent of the other one, but over
        many samples the two do not take all combinations. If you are not sure, use ``next_2d``.
        """
        dimension = ti.u32(self.dimension)
        self.count_term()
        if ti.static(self.sampler.shares_terms):
            dimension |= ti.u32(self.terms) << TERM_BIT
        return self.sampler.get_2d(self.seed, self.pixel, self.index, dimension)

    @ti.func
    def count_term(self):
        """Count the pair of ``next_2d_of_term``."""
        if ti.static(self.sampler.shares_terms):
            self.terms += 1
        else:
            self.dimension += 1

    @ti.func
    def next_1d(self):
        """One number in [0, 1)."""
        return self.next_2d().x

    @ti.func
    def skip_2d(self):
        """Skip the pair of the next dimension, because other code has taken it already."""
        self.dimension += 1

    @ti.func
    def skip_2d_of_term(self):
        """Skip the pair of ``next_2d_of_term``, because this sample has no such term."""
        if ti.static(not self.sampler.shares_terms):
            self.dimension += 1


@ti.data_oriented
@seams("start", "get_2d")
class Sampler:
    """The source of random numbers. A subclass defines ``get_2d``.

    Attributes:
        replicated: whether the samples with even and with odd index belong to two sequences. The two sequences are
            independent of each other, but the samples within one sequence are not; see ``picture.error_estimate``.
        doubles: whether all samples belong to one sequence. Then the error is bounded by the change of the picture when
            the number of samples doubles.
        is_net: whether every box of volume 2^−m contains exactly one of the first 2^m samples, in every dimension. If
            the sampler is replicated, this holds for each of its two sequences. The contract tests check it.
        shares_terms: whether the pair of ``next_2d_of_term`` has the dimension of the next ``next_2d``. ``get_2d`` then
            gets the number of the term, counted from 1, in the bits of ``dimension`` from TERM_BIT on.
        width, height: the size of the picture in pixels; the renderer sets it.
    """

    kind, name, replicated, doubles, is_net, shares_terms = "sampler", "", False, False, False, False
    width, height = 1, 1

    @in_kernels
    def start(self, seed, x, y, index) -> RandomNumbers:
        """Begin the numbers of one sample of one pixel; kernels call it."""
        return RandomNumbers(self, seed, x, y, index)

    @ti.func
    def pixel_number(self, x, y):
        """The number of a pixel, which is part of the key."""
        return ti.cast(y * self.width + x, ti.u32)

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """vec2 in [0, 1)², made of four u32: the pair for one use (dimension) in one sample (index) of one pixel."""
        ti.static_assert(False, "a sampler must say what get_2d(self, seed, pixel, index, dimension) is")
        return tm.vec2(0)


@ti.data_oriented
class PointSampler(Sampler):
    """A sampler whose pairs are the two numbers of a method ``point``, with which ``fast.number_lanes`` makes many."""

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """Two numbers in [0, 1)."""
        u, v = self.point(seed, pixel, index, dimension)
        return tm.vec2(u, v)

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors. A subclass defines it."""
        ti.static_assert(False, "a sampler of points must say what point(self, seed, pixel, index, dimension) is")
        return 0.0, 0.0


@register
@ti.data_oriented
@seams("point")
class SobolSampler(PointSampler):
    """Owen-scrambled Sobol' points: every use takes the first two dimensions in another order (Burley 2020).

    Samples with even and with odd index belong to two sequences that are scrambled independently. The difference of
    these sequences shows the error. In every pair of dimensions, the first 2^m samples of a sequence are a
    (0, m, 2)-net: every box of volume 2^−m contains exactly one of them. For n samples, the error decreases almost as
    fast as n^(−3/2) if the integrand is smooth. It is hardly ever larger than that of independent numbers.
    """

    name, replicated, is_net = "sobol", True, True

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors."""
        replica, place = index & ti.u32(1), index >> 1
        shuffle, seed_x, seed_y, _ = pcg4d(pixel, dimension, seed, replica)
        shuffled = reverse_bits(scramble_reversed(reverse_bits(place), shuffle))
        x = reverse_bits(scramble_reversed(shuffled, seed_x))
        y = reverse_bits(scramble_reversed(pascal_matrix(shuffled), seed_y))
        return as_fraction(x), as_fraction(y)


@register
@ti.data_oriented
@seams("point")
class NiederreiterSampler(PointSampler):
    """Owen-scrambled points of Niederreiter's (0, 4)-sequence in base 4: the pixel and a direction are even together.

    Two dimensions form a set, which is one sequence of four numbers: the pixel and the first surface, the second and
    the third surface, and so on. In every set, each box of volume 4^−m whose sides are powers of 1/4 contains exactly
    one of the first 4^m samples of a sequence. With pairs that are shuffled separately, this holds only in each
    dimension by itself; therefore, where light changes across a pixel, the error decreases more slowly. Every set takes
    the sequence in another order, and every number is scrambled by itself (Burley 2020). ``formulas.finite_fields`` has
    the sequence and its sources.

    As with ``SobolSampler``, samples with even and with odd index belong to two sequences, whose difference shows the
    error, and every pair of dimensions is a (0, m, 2)-net in base 2.
    """

    name, replicated, is_net, shares_terms = "niederreiter", True, True, True

    @ti.func
    def place_of(self, index):
        """(the number of the sequence, the place in it) of a sample."""
        return index & ti.u32(1), index >> 1

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors."""
        replica, place = self.place_of(index)
        first_of_set = dimension & ti.u32((1 << TERM_BIT) - 2)
        shuffle, _, _, _ = pcg4d(pixel, first_of_set, seed, replica)
        _, seed_x, seed_y, _ = pcg4d(pixel, dimension, seed, replica)
        shuffled = reverse_bits(scramble_reversed(reverse_bits(place), shuffle))
        first_x, first_y = first_pair(shuffled)
        second_x, second_y = second_pair(shuffled)
        is_second = (dimension & ti.u32(1)) == 1
        x, y = ti.select(is_second, second_x, first_x), ti.select(is_second, second_y, first_y)
        return as_fraction(reverse_bits(scramble_reversed(x, seed_x))), as_fraction(
            reverse_bits(scramble_reversed(y, seed_y))
        )


@register
@ti.data_oriented
@seams("point")
class OneNiederreiterSampler(NiederreiterSampler):
    """The points of ``NiederreiterSampler`` in one sequence: a smaller error, of which only a bound is known.

    Two sequences of n/2 points are less even together than one sequence of n points; but a single one has nothing that
    its mean could be compared with, except its own first half. The change of the picture when the number of samples
    doubles is a bound for the error after doubling, because the error before it is larger (see ``error_estimate``).
    """

    name, replicated, doubles = "niederreiter_one", False, True

    @ti.func
    def place_of(self, index):
        """(0, the place in the sequence) of a sample."""
        return index & ti.u32(0), index


@register
@ti.data_oriented
@seams("point")
class IndependentSampler(PointSampler):
    """Independent uniform numbers: for n samples, the error decreases as n^(−1/2) for every integrand."""

    name = "independent"

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers separately; the keys may also be vectors."""
        a, b, _, _ = pcg4d(pixel, index, dimension, seed)
        return as_fraction(a), as_fraction(b)


def sampler_of(chosen: Sampler, camera) -> Sampler:
    """A copy of a sampler that knows the size of a camera's pictures."""
    sampler = copy.copy(chosen)
    sampler.width, sampler.height = camera.width, camera.height
    return sampler


@in_kernels
def given_or_drawn(xi):
    """``xi``; or two random numbers if it is None, because the handout's functions draw their numbers themselves.

    In a picture, these are the next two numbers of the sample. A kernel of your own has no sample: it gets the numbers
    of Taichi's own generator, which differ from run to run.
    """
    if xi is not None:
        return xi
    rng = RandomNumbers.of_this_kernel()
    return taichi_pair() if rng is None else rng.next_2d()


@ti.func
def taichi_pair():
    """Two numbers of Taichi's own generator, as the handouts draw them."""
    return tm.vec2(ti.random(float), ti.random(float))


@ti.data_oriented
@seams("sample_direction", "evaluate_probability")
class UniformSampler:
    """Directions uniform on the sphere (A2-6); the estimator ``uniform`` takes its directions from it.

    Kernels call ``UniformSampler.sample_direction()``. Your own class can be passed as ``sampler=``, or it can be
    registered and passed by its name. Its methods may have the argument ``self``, but need not.
    """

    kind, name = "sampler", ""

    @staticmethod
    @ti.func
    def sample_direction(xi: ti.template() = None):
        """A unit direction, made of ``xi`` in [0, 1)², or of two random numbers if ``xi`` is None."""
        return uniform_sphere(given_or_drawn(xi))

    @staticmethod
    @ti.func
    def evaluate_probability():
        """1/(4π) per solid angle, for every direction."""
        return 1 / (4 * tm.pi)


@ti.data_oriented
@seams("sample_direction", "evaluate_probability", "evaluate_brdf", "evaluate_brdf_factor")
class BRDF(Brdf):
    """The handout's BRDF: diffuse if Ns is 1 or less, otherwise Phong (A2-4, A2-7, A2-8).

    The BRDFs in the folder ``brdfs`` compute the same values. This class takes their place as soon as one of its
    methods is replaced, either in a subclass (``brdfs=[MyBRDF()]``) or by an assignment to ``BRDF``.
    """

    name = "handout"
    needs = "every material"

    def describes(self, material: Any, dtype: type) -> bool:
        """Every material."""
        return True

    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal, xi: ti.template() = None):
        """w_i, drawn in proportion to the lobe around the normal (diffuse) or around ω_r (Phong) (A2-7)."""
        pair = given_or_drawn(xi)
        w_i = DIFFUSE.sample(material, w_o, normal, pair)
        if material.Ns > 1:
            w_i = PHONG.sample(material, w_o, normal, pair)
        return w_i

    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        """The density of ``sample_direction`` at w_i, per solid angle."""
        pdf = DIFFUSE.pdf(material, w_o, w_i, normal)
        if material.Ns > 1:
            pdf = PHONG.pdf(material, w_o, w_i, normal)
        return pdf

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        """f_r, without the cosine (A2-4)."""
        f = DIFFUSE.eval(material, w_o, w_i, normal)
        if material.Ns > 1:
            f = PHONG.eval(material, w_o, w_i, normal)
        return f

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        """f_r max(n·ω_i, 0) / pdf, cancelled (A2-8)."""
        weight = DIFFUSE.weight(material, w_o, w_i, normal)
        if material.Ns > 1:
            weight = PHONG.weight(material, w_o, w_i, normal)
        return weight

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """``evaluate_brdf``."""
        return called(self.evaluate_brdf, material, w_o, w_i, n)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """``evaluate_probability``."""
        return called(self.evaluate_probability, material, w_o, w_i, n)

    @ti.func
    def sample(self, material, w_o, n, xi):
        """``sample_direction``."""
        return called(self.sample_direction, material, w_o, n, xi=xi)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """``evaluate_brdf_factor``; or f_r cos θ_i / pdf, if only f_r or the pdf was replaced."""
        value = tm.vec3(0)
        if ti.static(self.has_own_factor()):
            value = called(self.evaluate_brdf_factor, material, w_o, w_i, n)
        else:
            value = eval_over_pdf(self, material, w_o, w_i, n)
        return value

    def has_own_factor(self) -> bool:
        """Whether the weight of a sample is ``evaluate_brdf_factor``, and not the quotient f_r cos θ_i / pdf."""
        names = replaced(self)
        return "evaluate_brdf_factor" in names or not {"evaluate_brdf", "evaluate_probability"} & set(names)


DIFFUSE, PHONG = Diffuse(), Phong()


@ti.data_oriented
@seams(
    "compute_triangle_area",
    "compute_cdf",
    "sample_emissive_triangle",
    "evaluate_probability",
    "sample_mesh_lights",
)
class MeshLightSampler(LampChoice):
    """The handout's sampler of mesh lights: a point uniform on all emissive triangles together (A3-2).

    The lamp choice "area" in the folder ``lights`` has the same density, and takes its numbers so that samples are
    distributed more evenly. This class takes its place as soon as one of its methods is replaced, either in a subclass
    (``lamp_choice=MyMeshLightSampler``) or by an assignment to ``MeshLightSampler``. All triangles have one density, so
    that one with less than 2⁻²⁴ of their area, the step of a random number in f32, may be lost; "area" keeps it.

    Attributes:
        emissive_triangle_ids: field of the ids of the triangles whose material has Ke > 0.
        n_emissive_triangles: their number.
        cdf: field of as many numbers: ``cdf[i]`` is the area of the first i + 1 of them / the total area.
        total_area: the sum of their areas.
    """

    name, samples_points = "handout", True

    def prepare(self, lamps: LampTable) -> None:
        """Compute the areas and their cumulative distribution."""
        if (lamps.primitives < 0).any():
            raise InputError(f"{type(self).__name__} samples triangles, but a sphere emits: use lamp_choice='power'")
        self.n_emissive_triangles = len(lamps)
        self._memory = memory.Memory()
        self.emissive_triangle_ids, self.cdf, self.areas = ti.field(ti.i32), ti.field(float), ti.field(float)
        triangles = self._memory.fields.dense(ti.i, self.n_emissive_triangles)
        triangles.place(self.emissive_triangle_ids, self.cdf, self.areas)
        self._memory.allocate()
        self.emissive_triangle_ids.from_numpy(lamps.primitives)
        self._compute_areas()
        self.total_area = float(self.areas.to_numpy().astype(np.float64).sum())
        self.compute_cdf()

    @ti.kernel
    def _compute_areas(self):
        for i in self.areas:
            v0, v1, v2 = self.geometry.triangle(self.emissive_triangle_ids[i])
            self.areas[i] = called(self.compute_triangle_area, v0, v1, v2)

    @staticmethod
    @ti.func
    def compute_triangle_area(v0, v1, v2):
        """|(v1 − v0) × (v2 − v0)| / 2."""
        return tm.cross(v1 - v0, v2 - v0).norm() / 2

    @ti.kernel
    def compute_cdf(self):
        """Sum up the areas. The sum is kept in f64 where the backend has it, so that it stays exact."""
        total = widened(0.0)
        ti.loop_config(serialize=True)
        for i in range(self.n_emissive_triangles):
            total += self.areas[i]
            self.cdf[i] = total / self.total_area

    @ti.func
    def sample_emissive_triangle(self, xi: ti.template() = None):
        """i of a triangle, in proportion to the areas: a binary search for cdf[i − 1] ≤ ξ < cdf[i].

        Its id is ``emissive_triangle_ids[i]``. ``xi`` is a pair of numbers, of which one is used.
        """
        low, high, number = 0, self.n_emissive_triangles - 1, given_or_drawn(xi).x
        while low < high:
            middle = (low + high) >> 1
            if number < self.cdf[middle]:
                high = middle
            else:
                low = middle + 1
        return low

    @ti.func
    def evaluate_probability(self):
        """1/total area: the density of the point, per area."""
        return 1 / self.total_area

    @ti.func
    def sample_mesh_lights(self, hit_point, xi: ti.template() = None):
        """(w_i, triangle id) of the direction from a point to a point that is uniform on the emissive triangles."""
        triangle_id = self.emissive_triangle_ids[called(self.sample_emissive_triangle)]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        place = uniform_triangle(given_or_drawn(xi))
        y = v0 + place.x * (v1 - v0) + place.y * (v2 - v0)
        return (y - hit_point).normalized(), triangle_id

    @ti.func
    def choose(self, x, n, xi):
        """(i, probability, ξ) of the i-th emissive triangle."""
        i = called(self.sample_emissive_triangle, xi=tm.vec2(xi))
        return i, self.probability(x, n, i), xi

    @ti.func
    def probability(self, x, n, lamp):
        """Its area × ``evaluate_probability``."""
        return self.areas[lamp] * called(self.evaluate_probability)
