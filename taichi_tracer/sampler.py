"""Where random numbers come from, and the samplers of directions and lights that the handouts name.

A number is a hash of (seed, pixel, sample index, dimension). It is the same on every run, with every number of threads
and on every backend, and any range of samples can be rendered on any machine. In a kernel,
``rng = sampler.start(seed, x, y, index)`` begins the numbers of one sample, see ``formulas.random_numbers``. The folder
``samplers`` has the sequences.
"""

import copy
from typing import Any

import taichi as ti

from taichi_tracer.brdfs.base import HandoutBrdf
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.microfacet import MicrofacetBRDF as MicrofacetBRDF  # as the handout names it
from taichi_tracer.brdfs.phong import Phong
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.frames import frame_about, mirrored
from taichi_tracer.formulas.random_numbers import RandomNumbers, given_or_drawn
from taichi_tracer.formulas.warps import uniform_sphere
from taichi_tracer.lights.mesh_light_sampler import MeshLightSampler as MeshLightSampler  # as the handout names it
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.parts import overridable

DEFAULT_SAMPLER, ADAPTIVE_SAMPLER = "niederreiter", "niederreiter_two"  # of pictures; of adaptive ones


@ti.data_oriented
@overridable("start", get_2d="vec2")
class Sampler:
    """The source of random numbers. A subclass defines ``get_2d``.

    Attributes:
        replicated: whether the samples with even and with odd index belong to two sequences. The two sequences are
            independent of each other, but the samples within one sequence are not; see ``picture.error_estimate``.
        doubles: whether all samples belong to one sequence. Then the change of the picture when the number of samples
            doubles shows the error.
        shares_terms: whether the pair of ``next_2d_of_term`` has the dimension of the next ``next_2d``. ``get_2d`` then
            gets the number of the term, counted from 1, in the bits of ``dimension`` from TERM_BIT on.
        width, height: the size of the picture in pixels; the renderer sets it.
    """

    kind, name, replicated, doubles, shares_terms = "sampler", "", False, False, False
    required = ("get_2d",)
    width, height = 1, 1

    @compile_time
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


def usual_sampler(adaptive: bool) -> str:
    """The name of the sampler of a picture, unless another one is given."""
    return ADAPTIVE_SAMPLER if adaptive else DEFAULT_SAMPLER


def sampler_of(chosen: Sampler, camera) -> Sampler:
    """A copy of a sampler that knows the size of a camera's pictures."""
    sampler = copy.copy(chosen)
    sampler.width, sampler.height = camera.width, camera.height
    return sampler


@ti.data_oriented
@overridable(sample_direction="vec3", evaluate_probability="number")
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
@overridable(sample_direction="vec3", evaluate_probability="number", evaluate_brdf="vec3", evaluate_brdf_factor="vec3")
class BRDF(HandoutBrdf):
    """The handout's BRDF: diffuse if Ns is 1 or less, otherwise Phong (A2-4, A2-7, A2-8).

    The BRDFs in the folder ``brdfs`` compute the same values. This class takes their place as soon as one of its
    methods is replaced, either in a subclass (``brdfs=[MyBRDF()]``) or by an assignment to ``BRDF``.
    """

    name = "handout"
    has_microfacets = False
    needs = "every material"

    def describes(self, material: Any, dtype: type) -> bool:
        """Every material."""
        return True

    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal, xi: ti.template() = None):
        """w_i, drawn in proportion to the lobe around the normal (diffuse) or around ω_r (Phong) (A2-7)."""
        pair = given_or_drawn(xi)
        phong, diffuse = PHONG.sample(material, w_o, normal, pair), DIFFUSE.sample(material, w_o, normal, pair)
        return ti.select(material.Ns > 1, phong, diffuse)

    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        """The density of ``sample_direction`` at w_i, per solid angle."""
        phong, diffuse = PHONG.pdf(material, w_o, w_i, normal), DIFFUSE.pdf(material, w_o, w_i, normal)
        return ti.select(material.Ns > 1, phong, diffuse)

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        """f_r, without the cosine (A2-4)."""
        phong, diffuse = PHONG.eval(material, w_o, w_i, normal), DIFFUSE.eval(material, w_o, w_i, normal)
        return ti.select(material.Ns > 1, phong, diffuse)

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        """f_r max(n·ω_i, 0) / pdf, cancelled (A2-8)."""
        phong, diffuse = PHONG.weight(material, w_o, w_i, normal), DIFFUSE.weight(material, w_o, w_i, normal)
        return ti.select(material.Ns > 1, phong, diffuse)


DIFFUSE, PHONG = Diffuse(), Phong()


@ti.func
def ortho_frames(axis):
    """The 3 × 3 matrix whose columns are a right-handed frame; the last one is ``axis``, a unit vector."""
    x, y = frame_about(axis)
    return tm.mat3([[x[k], y[k], axis[k]] for k in ti.static(range(3))])


@ti.func
def reflect(w_o, normal):
    """ω_r = 2 (n·ω_o) n − ω_o (A2-4)."""
    return mirrored(w_o, normal)
