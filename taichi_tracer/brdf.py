"""How a surface reflects: diffuse, Phong, and Phong so narrow that it is a mirror (A2-4, A2-7, A2-8).

All directions have unit length and leave the surface: w_o to the viewer, w_i to the light. Vectors are in world space,
n is the shading normal on the viewer's side. ``eval`` is f_r, without the cosine. ``pdf`` and ``sample`` are per solid
angle. ``weight`` is f_r cos θ_i / pdf of a sampled direction, cancelled: as a quotient it is 0/0 for narrow lobes
(C-3). A w_i below the horizon of n reflects nothing; that of the triangle's plane is the caller's to check.

A BRDF is a class here and a line in ``ALL``; scenes, kernels and tests find it there. ``describes`` says on the host
which materials it is for: the first that does is taken.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer import sampler
from taichi_tracer.materials import Material


@ti.func
def mirrored(w_o, n):
    """ω_r = 2 (n·ω_o) n − ω_o."""
    return 2 * tm.dot(n, w_o) * n - w_o


class Diffuse:
    """f_r = Kd/π (Lambert)."""

    name = "diffuse"
    is_delta = False
    needs = "every material that is not Phong"

    @staticmethod
    def describes(material: Material, dtype: type) -> bool:
        """Ns of 1 or less, or none (C-4)."""
        return material.Ns <= 1

    @staticmethod
    @ti.func
    def eval(material, w_o, w_i, n):
        """f_r."""
        return material.Kd / tm.pi

    @staticmethod
    @ti.func
    def pdf(material, w_o, w_i, n):
        """max(0, n·ω_i)/π."""
        return ti.max(0.0, tm.dot(n, w_i)) / tm.pi

    @staticmethod
    @ti.func
    def sample(material, w_o, n, xi):
        """w_i, cosine-distributed about n."""
        return sampler.cosine_hemisphere(n, xi)

    @staticmethod
    @ti.func
    def weight(material, w_o, w_i, n):
        """Kd: the cosine cancels."""
        return material.Kd


class Phong:
    """f_r = Kd (Ns+1)/(2π) max(0, ω_r·ω_i)^Ns (Lafortune & Willems 1994, its specular lobe).

    Not energy-normalised with the cosine: at normal incidence the albedo is Kd (Ns+1)/(Ns+2) (C-19).
    """

    name = "phong"
    is_delta = False
    needs = "a material with Ns > 1"

    @staticmethod
    def describes(material: Material, dtype: type) -> bool:
        """Ns > 1, and a lobe wider than the rounding of a direction."""
        return 1 < material.Ns < mirror_from(dtype)

    @staticmethod
    @ti.func
    def eval(material, w_o, w_i, n):
        """f_r, as Kd times the pdf of the lobe."""
        return material.Kd * Phong.pdf(material, w_o, w_i, n)

    @staticmethod
    @ti.func
    def pdf(material, w_o, w_i, n):
        """(α+1)/(2π) max(0, ω_r·ω_i)^α, with cos^α = exp(α/2 log(1 − sin²)): cos itself rounds to 1 (C-2)."""
        w_r = mirrored(w_o, n)
        sine_squared = tm.cross(w_r, w_i).norm_sqr()
        lobe = 0.0
        if tm.dot(w_r, w_i) > 0 and sine_squared < 1:
            lobe = ti.exp(material.Ns / 2 * log1p_of_negative(sine_squared))
        return (material.Ns + 1) / (2 * tm.pi) * lobe

    @staticmethod
    @ti.func
    def sample(material, w_o, n, xi):
        """w_i about ω_r."""
        return sampler.power_cosine(mirrored(w_o, n), material.Ns, xi)

    @staticmethod
    @ti.func
    def weight(material, w_o, w_i, n):
        """Kd max(n·ω_i, 0): the lobe cancels."""
        return material.Kd * ti.max(0.0, tm.dot(n, w_i))


class Mirror:
    """Phong in the limit Ns → ∞: a reflection into the one direction ω_r, with the weight of Phong."""

    name = "mirror"
    is_delta = True
    needs = "a material with an Ns too large for the precision"

    @staticmethod
    def describes(material: Material, dtype: type) -> bool:
        """Ns so large that the lobe is narrower than the rounding of a direction."""
        return material.Ns >= mirror_from(dtype)

    @staticmethod
    @ti.func
    def eval(material, w_o, w_i, n):
        """0: no direction that was not made by ``sample`` is ω_r."""
        return tm.vec3(0)

    @staticmethod
    @ti.func
    def pdf(material, w_o, w_i, n):
        """0, as for ``eval``."""
        return 0.0

    @staticmethod
    @ti.func
    def sample(material, w_o, n, xi):
        """ω_r."""
        return mirrored(w_o, n)

    @staticmethod
    @ti.func
    def weight(material, w_o, w_i, n):
        """Kd max(n·ω_i, 0)."""
        return material.Kd * ti.max(0.0, tm.dot(n, w_i))


ALL = (Diffuse, Mirror, Phong)


def mirror_from(dtype: type) -> float:
    """The exponent whose lobe, about 1/√Ns wide, is as narrow as ε of the precision."""
    return float(np.finfo(dtype).eps) ** -2


def brdf_of(material: Material, dtype: type) -> int:
    """Index into ``ALL`` of the BRDF that a material has."""
    return next(i for i, brdf in enumerate(ALL) if brdf.describes(material, dtype))


@ti.func
def log1p_of_negative(x):
    """log(1 − x) for 0 ≤ x < 1, also where 1 − x rounds to 1 (Kahan; Goldberg 1991, theorem 4)."""
    y = 1 - x
    return ti.select(y == 1, -x, ti.log(y) * -x / ti.select(y == 1, -1.0, y - 1))
