"""Points on triangles and directions to spheres, for lights that have an area. Each function states its density."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.frames import from_frame
from taichi_tracer.formulas.triangles import unit
from taichi_tracer.system import runtime


@ti.func
def uniform_triangle(xi):
    """(u, v), the weights of v1 and v2 of a point uniform on a triangle; density 1/area (A3-2).

    Heitz, "A low-distortion map between triangle and square", 2019: unlike the map with a square root, it keeps points
    that are near each other in ξ near each other on the triangle.
    """
    b0, b1 = xi.x / 2, xi.y - xi.x / 2
    if xi.x >= xi.y:
        b0, b1 = xi.x - xi.y / 2, xi.y / 2
    return tm.vec2(b1, 1 - b0 - b1)


@ti.func
def solid_angle(a, b, c):
    """The solid angle of a triangle whose vertices are seen in the directions a, b and c, of any length.

    tan(Ω/2) = |a·(b × c)| / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|); van Oosterom & Strackee, "The solid
    angle of a plane triangle", 1983.
    """
    a, b, c = unit(a), unit(b), unit(c)
    return 2 * ti.atan2(abs(tm.dot(a, tm.cross(b, c))), 1 + tm.dot(a, b) + tm.dot(b, c) + tm.dot(c, a))


@ti.func
def uniform_spherical_triangle(a, b, c, omega, xi):
    """A direction uniform in the solid angle ``omega`` of the triangle with the unit directions a, b, c; pdf 1/omega.

    Arvo, "Stratified sampling of spherical triangles", SIGGRAPH 1995: ξ₁ cuts off a triangle a b c' of the area ξ₁ Ω,
    and ξ₂ chooses a point of the arc between b and c'. α is the angle at a.
    """
    n_ab, n_ac = tm.normalize(tm.cross(a, b)), tm.normalize(tm.cross(a, c))
    cos_α, sin_α = tm.dot(n_ab, n_ac), tm.length(tm.cross(n_ab, n_ac))
    s, t = ti.sin(xi.x * omega), ti.cos(xi.x * omega)
    s, t = s * cos_α - t * sin_α, t * cos_α + s * sin_α  # sine and cosine of ξ₁ Ω − α
    u, v = t - cos_α, s + sin_α * tm.dot(a, b)
    q = tm.clamp(((v * t - u * s) * cos_α - v) / ((v * s + u * t) * sin_α), -1.0, 1.0)
    c_hat = q * a + ti.sqrt(1 - q * q) * tm.normalize(c - tm.dot(c, a) * a)
    z = 1 - xi.y * (1 - tm.dot(c_hat, b))
    towards = c_hat - tm.dot(c_hat, b) * b
    return z * b + ti.sqrt(ti.max(0.0, 1 - z * z)) * towards / ti.max(tm.length(towards), ti.static(runtime.smallest()))


@ti.func
def cone_of_sphere(distance, radius):
    """1 − cos θ of the cone in which a sphere is seen from a distance > radius to its centre (PBR, 4th edition, 6.2.4).

    It is sin²θ / (1 + cos θ), which keeps its digits if the sphere is small.
    """
    sine = radius / distance
    sine_squared = sine * sine
    return sine_squared / (1 + ti.sqrt(ti.max(0.0, 1 - sine_squared)))


@ti.func
def uniform_cone(axis, one_minus_cosine, xi):
    """A direction uniform in a cone around ``axis``; pdf 1/(2π (1 − cos θ)) per solid angle."""
    drop = xi.x * one_minus_cosine
    sine = ti.sqrt(ti.max(0.0, drop * (2 - drop)))
    return from_frame(axis, 1 - drop, sine, xi.y)
