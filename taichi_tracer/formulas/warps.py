"""Directions made of two uniform random numbers ξ in [0, 1)². Each function states its density per solid angle."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.angles import on_circle
from taichi_tracer.formulas.frames import from_frame

SMALLEST_XI = 2.0**-25  # replaces ξ = 0, whose logarithm is infinite; it is half of the smallest ξ above 0 in f32
# Below this a, three terms of the series of 1 − exp(−a) are exact in f32: the next term is only a⁴/24.
SERIES_BELOW = 1e-2


@ti.func
def uniform_sphere(xi):
    """A direction uniform on the sphere; pdf 1/(4π) per solid angle (A2-6)."""
    z = 2 * xi.x - 1
    r = ti.sqrt(ti.max(0.0, 1 - z * z))
    x, y = on_circle(xi.y)
    return tm.vec3(r * x, r * y, z)


@ti.func
def uniform_hemisphere(n, xi):
    """A direction uniform on the hemisphere around n; pdf 1/(2π) per solid angle."""
    return from_frame(n, xi.x, ti.sqrt(ti.max(0.0, 1 - xi.x * xi.x)), xi.y)


@ti.func
def cosine_hemisphere(n, xi):
    """A direction around n with pdf max(0, ω·n)/π per solid angle: ω_z = √ξ (A2-7, α = 1)."""
    return from_frame(n, ti.sqrt(xi.x), ti.sqrt(1 - xi.x), xi.y)


@ti.func
def power_cosine(axis, exponent, xi):
    """A direction around ``axis`` with pdf (α+1)/(2π) max(0, ω·axis)^α per solid angle (A2-7, ω_z = ξ^(1/(α+1))).

    sin² is computed first, as 1 − exp(2 ln ξ/(α+1)). For large α, ξ^(1/(α+1)) is close to 1 and would lose its digits:
    for α = 10⁶ it has only a few hundred different values in f32.
    """
    a = -2 * ti.log(ti.max(xi.x, SMALLEST_XI)) / (exponent + 1)
    sine_squared = ti.select(a < SERIES_BELOW, a - a * a / 2 + a * a * a / 6, 1 - ti.exp(-a))
    cosine = ti.sqrt(ti.max(0.0, 1 - sine_squared))
    return from_frame(axis, cosine, ti.sqrt(ti.max(0.0, sine_squared)), xi.y)
