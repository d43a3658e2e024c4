"""Random numbers that depend on nothing but their key, and the two samplers of directions that the handouts name.

A number is a hash of (seed, pixel, sample index, dimension): the same on every run, thread count and backend, and any
range of samples can be rendered anywhere. In a kernel, ``rng = sampler.start(seed, x, y, index)`` begins the numbers of
one sample, and each ``rng.next_2d()`` or ``rng.next_1d()`` takes those of the next dimension. There are as many
dimensions as anybody asks for. The first pair of every sample belongs to the pixel (A2-1); then every surface takes one
pair for its BRDF and one for the light.
"""

import copy

import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.phong import Phong
from taichi_tracer.formulas.hashes import as_fraction, pascal_matrix, pcg4d, reverse_bits, scramble_reversed
from taichi_tracer.formulas.warps import uniform_sphere
from taichi_tracer.system.registry import register
from taichi_tracer.system.seams import called, in_kernels, replaced, seams


class RandomNumbers:
    """The numbers of one sample of one pixel, inside a kernel: what ``Sampler.start`` returns.

    Attributes:
        x, y, index: which pixel, and which of its samples.
        dimension: how many were taken.
    """

    _data_oriented = True  # lets a kernel hold it in a variable, and pass it on
    _begun_last: tuple | None = None  # (the kernel that is compiled, its numbers)

    def __init__(self, sampler: "Sampler", seed, x, y, index) -> None:
        self.sampler, self.seed, self.x, self.y, self.index = sampler, seed, x, y, index
        self.dimension = impl.expr_init(0)
        self.pixel = impl.expr_init(sampler.pixel_number(x, y))
        RandomNumbers._begun_last = impl.get_runtime().compiling_callable, self

    @classmethod
    def of_this_kernel(cls) -> "RandomNumbers | None":
        """The numbers that the kernel which is compiled now has begun; None when it has not."""
        begun = cls._begun_last
        return begun[1] if begun is not None and begun[0] is impl.get_runtime().compiling_callable else None

    @ti.func
    def next_2d(self):
        """Two numbers in [0, 1)."""
        dimension = ti.u32(self.dimension)
        self.dimension += 1
        return self.sampler.get_2d(self.seed, self.pixel, self.index, dimension)

    @ti.func
    def next_1d(self):
        """One number in [0, 1)."""
        return self.next_2d().x

    @ti.func
    def skip_2d(self):
        """Leave out a pair that was taken elsewhere."""
        self.dimension += 1


@ti.data_oriented
@seams("start", "get_2d")
class Sampler:
    """Where random numbers come from. A subclass says what ``get_2d`` is.

    Attributes:
        replicated: whether samples of even and of odd index belong to two sequences that are independent of each other,
            and are not independent within one; see ``picture.error_estimate``.
        is_net: whether the first 2^m samples, of each sequence where it is replicated, lie one in each box of volume
            2^−m, in every dimension: the contract tests hold it to that.
        width, height: pixels of the picture, which the renderer sets.
    """

    kind, name, replicated, is_net = "sampler", "", False, False
    width, height = 1, 1

    @in_kernels
    def start(self, seed, x, y, index) -> RandomNumbers:
        """Begin the numbers of one sample of one pixel; called in a kernel."""
        return RandomNumbers(self, seed, x, y, index)

    @ti.func
    def pixel_number(self, x, y):
        """The key of a pixel."""
        return ti.cast(y * self.width + x, ti.u32)

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """vec2 in [0, 1)² of four u32: for one use (dimension) in one sample (index) of one pixel."""
        ti.static_assert(False, "a sampler must say what get_2d(self, seed, pixel, index, dimension) is")
        return tm.vec2(0)


@register
@ti.data_oriented
@seams("point")
class SobolSampler(Sampler):
    """Owen-scrambled Sobol' points, one pair of dimensions for each use, shuffled against each other (Burley 2020).

    Samples of even and of odd index belong to two sequences, scrambled independently, whose difference tells the error.
    The first 2^m samples of each are a (0, m, 2)-net in every pair: one in each box of volume 2^−m. The error falls
    towards n^(−3/2) where the integrand is smooth, and hardly ever lies above that of independent numbers.
    """

    name, replicated, is_net = "sobol", True, True

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """Two numbers in [0, 1)."""
        x, y = self.point(seed, pixel, index, dimension)
        return tm.vec2(x, y)

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers one by one; also of vectors of keys."""
        replica, place = index & ti.u32(1), index >> 1
        shuffle, seed_x, seed_y, _ = pcg4d(pixel, dimension, seed, replica)
        shuffled = reverse_bits(scramble_reversed(reverse_bits(place), shuffle))
        x = reverse_bits(scramble_reversed(shuffled, seed_x))
        y = reverse_bits(scramble_reversed(pascal_matrix(shuffled), seed_y))
        return as_fraction(x), as_fraction(y)


@register
@ti.data_oriented
@seams("point")
class IndependentSampler(Sampler):
    """Independent uniform numbers: the error falls with n^(−1/2), whatever the integrand."""

    name = "independent"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        """Two numbers in [0, 1)."""
        x, y = self.point(seed, pixel, index, dimension)
        return tm.vec2(x, y)

    @ti.func
    def point(self, seed, pixel, index, dimension):
        """The two numbers one by one; also of vectors of keys."""
        a, b, _, _ = pcg4d(pixel, index, dimension, seed)
        return as_fraction(a), as_fraction(b)


def sampler_of(chosen: Sampler, camera) -> Sampler:
    """A copy of a sampler for the pictures of a camera."""
    sampler = copy.copy(chosen)
    sampler.width, sampler.height = camera.width, camera.height
    return sampler


@in_kernels
def given_or_drawn(xi):
    """``xi``, or where it is None two random numbers, since the handout's functions draw theirs themselves.

    In a picture they are the next ones of the sample. A kernel of your own has no sample, and gets Taichi's numbers,
    which differ from run to run.
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
    """Directions uniform on the sphere (A2-6): what the estimator ``uniform`` takes its samples from.

    In a kernel, ``UniformSampler.sample_direction()``. A class of your own is given to the slot of the sampler, or
    registered and named there; its methods may have ``self`` or not.
    """

    kind, name = "sampler", ""

    @staticmethod
    @ti.func
    def sample_direction(xi: ti.template() = None):
        """A unit direction; from ``xi`` in [0, 1)², or from numbers of its own."""
        return uniform_sphere(given_or_drawn(xi))

    @staticmethod
    @ti.func
    def evaluate_probability():
        """1/(4π) per solid angle, whatever the direction."""
        return 1 / (4 * tm.pi)


@ti.data_oriented
@seams("sample_direction", "evaluate_probability", "evaluate_brdf", "evaluate_brdf_factor")
class BRDF(Brdf):
    """The handout's reflection: diffuse where Ns is 1 or less, Phong above (A2-4, A2-7, A2-8).

    The scene's own BRDFs (``brdfs``) compute the same. This class takes their place as soon as one of its methods is
    replaced: by ``brdfs=[MyBRDF()]``, or by assigning to ``BRDF``.
    """

    name = "handout"
    needs = "every material"

    def describes(self, material, dtype: type) -> bool:
        """Every material."""
        return True

    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal, xi: ti.template() = None):
        """w_i in proportion to the lobe about the normal, or about ω_r (A2-7)."""
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
        """``evaluate_brdf_factor``, or where only what it is made of was replaced, f_r cos θ_i / pdf."""
        value = tm.vec3(0)
        if ti.static(self.has_own_factor()):
            value = called(self.evaluate_brdf_factor, material, w_o, w_i, n)
        else:
            value = self.eval(material, w_o, w_i, n) * ti.max(0.0, tm.dot(n, w_i)) / self.pdf(material, w_o, w_i, n)
        return value

    def has_own_factor(self) -> bool:
        """Whether ``evaluate_brdf_factor`` says what a sample is worth."""
        names = replaced(self)
        return "evaluate_brdf_factor" in names or not {"evaluate_brdf", "evaluate_probability"} & set(names)


DIFFUSE, PHONG = Diffuse(), Phong()
