"""A rough conductor: tiny mirrors whose normals ω_m are distributed by the anisotropic GGX (A2-11 … A2-13).

D is the distribution of the normals, G the part of them that light and viewer both see (Smith, height-correlated), and
F Schlick's approximation of what they reflect. x, y and z are coordinates in the frame about n, with

    s(ω) = √(α_x² x² + α_y² y² + z²),   Λ(ω) = (s/z − 1)/2,   D(ω_m) = 1/(π α_x α_y ((x/α_x)² + (y/α_y)² + z²)²)

Written with s, everything that is 0/0 at grazing angles cancels:

    G/(4 z_i z_o) = 1/(2 (s_o z_i + s_i z_o)),     pdf = D/(2 (z_o + s_o)),
    F G/G1(ω_o) = F z_i (z_o + s_o)/(s_o z_i + s_i z_o)

Light that would be reflected twice between the tiny mirrors is lost: a white metal with α = 0.3 reflects 88 % of the
light from above, with α = 0.5 69 %, and with α = 1 31 %.
"""

from typing import Any

import taichi as ti

from taichi_tracer.brdfs.base import Brdf, DeltaBrdf, HandoutBrdf
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.angles import on_circle
from taichi_tracer.formulas.frames import frame_about, mirrored
from taichi_tracer.formulas.random_numbers import given_or_drawn
from taichi_tracer.system.parts import overridable, register

# Below this roughness, the rounding of two directions in f32, 1e-7, changes D by more than 1 %: a mirror stands in.
SMOOTH_BELOW = 2.0**-14
LEAST_HEIGHT = 1e-18  # of a view in ``sample``: its square is above 0, so that a view from −n has a direction, too
LAYERED = "layered"  # the key of ``Material.extra`` that is 1 where the rough layer has a base, see ``rough_layer``


@register
@ti.data_oriented
@overridable()
class Microfacet(Brdf):
    """f_r = D F G/(4 cos θ_i cos θ_o), with ``alpha_x``, ``alpha_y`` and ``F0`` of the material."""

    name = "microfacet"
    reaches_all = True
    needs = "a material with alpha_x and alpha_y > 0"

    def describes(self, material: Any, dtype: type) -> bool:
        """A roughness of which at least one axis is above ``SMOOTH_BELOW``."""
        return material.is_rough and max(material.alpha_x, material.alpha_y) >= SMOOTH_BELOW

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """D F G/(4 z_i z_o)."""
        value = tm.vec3(0)
        alpha, o, i = alphas(material), in_frame(w_o, n), in_frame(w_i, n)
        if o.z > 0 and i.z > 0:
            m = tm.normalize(o + i)
            F = schlick(material.F0, tm.dot(o, m))
            value = F * distribution(alpha, m) / (2 * (scaled_length(alpha, o) * i.z + scaled_length(alpha, i) * o.z))
        return value

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """The density of the visible normals, D_{ω_o}(ω_m)/(4 ω_o·ω_m), per solid angle of w_i."""
        value = 0.0
        alpha, o, i = alphas(material), in_frame(w_o, n), in_frame(w_i, n)
        if o.z > 0 and (o + i).norm_sqr() > 0:
            m = tm.normalize(o + i)
            if m.z > 0:  # ω_o·ω_m is |ω_o + ω_i|/2, which is above 0, also where its rounded value is not
                value = distribution(alpha, m) / (2 * (o.z + scaled_length(alpha, o)))
        return value

    @ti.func
    def sample(self, material, w_o, n, xi):
        """w_o mirrored at a visible normal, which a spherical cap gives (Dupuy & Benyoub, HPG 2023, listing 3)."""
        alpha, o = alphas(material), in_frame(w_o, n)
        u = tm.normalize(tm.vec3(alpha.x * o.x, alpha.y * o.y, ti.max(o.z, LEAST_HEIGHT)))
        height = (1 - xi.y) * (1 + u.z)  # of the point of the cap, above −u
        z = height - u.z
        x, y = on_circle(xi.x)
        r = ti.sqrt(tm.clamp(1 - z * z, 0, 1))
        h = tm.vec3(r * x + u.x, r * y + u.y, height)
        m = tm.normalize(tm.vec3(alpha.x * h.x, alpha.y * h.y, ti.max(h.z, 0)))
        return from_frame_of(mirrored(o, m), n)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """F G/G1(ω_o): D cancels."""
        value = tm.vec3(0)
        alpha, o, i = alphas(material), in_frame(w_o, n), in_frame(w_i, n)
        if o.z > 0 and i.z > 0:
            s_o, s_i = scaled_length(alpha, o), scaled_length(alpha, i)
            F = schlick(material.F0, tm.dot(o, tm.normalize(o + i)))
            value = F * (i.z * (o.z + s_o) / (s_o * i.z + s_i * o.z))
        return value


@register
@ti.data_oriented
@overridable()
class SmoothConductor(DeltaBrdf):
    """The limit of ``Microfacet`` for α → 0: f_r = F δ(ω_i − ω_r) / cos θ_i."""

    name = "smooth_metal"
    needs = "a metal with a roughness so small that it is a mirror"

    def describes(self, material: Any, dtype: type) -> bool:
        """A roughness that is below what the precision resolves."""
        return material.is_rough and max(material.alpha_x, material.alpha_y) < SMOOTH_BELOW

    @ti.func
    def sample(self, material, w_o, n, xi):
        """ω_r."""
        return mirrored(w_o, n)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """F."""
        return schlick(material.F0, tm.dot(w_o, n))


MICROFACET = Microfacet()


@ti.data_oriented
@overridable(sample_direction="vec3", evaluate_probability="number", evaluate_brdf="vec3", evaluate_brdf_factor="vec3")
class MicrofacetBRDF(HandoutBrdf):
    """The names of the handout for ``Microfacet`` (A2-12).

    This class takes the place of ``Microfacet`` and of ``SmoothConductor`` as soon as one of its methods is replaced.
    """

    name = "handout's microfacets"
    needs = Microfacet.needs

    def describes(self, material: Any, dtype: type) -> bool:
        """Every material with a roughness, but for the layer of ``rough_layer``, which has a base."""
        return material.is_rough and material.value(LAYERED, 0.0) != 1

    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal, xi: ti.template() = None):
        """w_i, made of two random numbers."""
        return MICROFACET.sample(material, w_o, normal, given_or_drawn(xi))

    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        """The density of ``sample_direction`` at w_i, per solid angle."""
        return MICROFACET.pdf(material, w_o, w_i, normal)

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        """f_r, without the cosine."""
        return MICROFACET.eval(material, w_o, w_i, normal)

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        """f_r max(n·ω_i, 0)/pdf, cancelled."""
        return MICROFACET.weight(material, w_o, w_i, normal)


@ti.func
def alphas(material):
    """(α_x, α_y), at least ``SMOOTH_BELOW``."""
    return ti.max(tm.vec2(material.alpha_x, material.alpha_y), SMOOTH_BELOW)


@ti.func
def in_frame(w, n):
    """The coordinates of a direction in the frame about n, which is the same everywhere (A2-13)."""
    x_axis, y_axis = frame_about(n)
    return tm.vec3(tm.dot(x_axis, w), tm.dot(y_axis, w), tm.dot(n, w))


@ti.func
def from_frame_of(w, n):
    """The inverse of ``in_frame``."""
    x_axis, y_axis = frame_about(n)
    return w.x * x_axis + w.y * y_axis + w.z * n


@ti.func
def scaled_length(alpha, w):
    """s(ω)."""
    return ti.sqrt(alpha.x * w.x * (alpha.x * w.x) + alpha.y * w.y * (alpha.y * w.y) + w.z * w.z)


@ti.func
def distribution(alpha, m):
    """D(ω_m), per solid angle."""
    x, y = m.x / alpha.x, m.y / alpha.y
    t = x * x + y * y + m.z * m.z
    return 1 / (tm.pi * alpha.x * alpha.y * t * t)


@ti.func
def schlick(F0, cosine):
    """F0 + (1 − F0)(1 − ω_o·ω_m)⁵."""
    c = 1 - tm.clamp(cosine, 0, 1)
    return F0 + (1 - F0) * (c * c * (c * c) * c)
