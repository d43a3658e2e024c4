"""The intersection of a ray and a sphere in closed form, in an order of operations that loses few digits."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.angles import azimuth, latitude
from taichi_tracer.system import runtime


@ti.func
def widened(x):
    """``x`` in f64, if kernels run in f32 and the backend has f64. Then the decision hit or miss is exact."""
    if ti.static(runtime.can_widen()):
        return ti.cast(x, ti.f64)
    else:  # noqa: RET505 (Taichi compiles one of the two)
        return x


@ti.func
def without_overflow(d):
    """(w, s) with d = s w, so that no square of w overflows or is 0, however long or short d is.

    In f64, the squares of all numbers of f32 are far from both. Then w is d.
    """
    if ti.static(runtime.can_widen()):
        return d, widened(1.0)
    s = abs(d).max()
    return d / s, s


@ti.func
def sphere_roots(o, d, centre, radius):
    """Solve  |o + t d − c| = r  (Haines, Günther & Akenine-Möller, "Precision improvements for ray/sphere
    intersection", Ray Tracing Gems, 2019, section 7.3).

    Returns (is_met, t_in, t_out) with t_in ≤ t_out. The discriminant is r² − l·l, a difference of two numbers of the
    size of the sphere. The usual b² − a c would lose a small sphere that is far away. The root with the smaller |t| is
    c/q, because the usual formula cancels there.

    l = f + (b/a) d is the point of the line that is nearest to the centre, with f = o − c, a = d·d and b = −f·d.
    """
    w, size = without_overflow(d)
    f = o - centre
    a = tm.dot(w, w)
    b = -tm.dot(f, w)
    c = tm.dot(f, f) - radius * radius
    l = f + b / a * w
    discriminant = radius * radius - tm.dot(l, l)
    is_met = discriminant >= 0

    root = ti.sqrt(a * ti.select(is_met, discriminant, 0))
    q = ti.select(b >= 0, b + root, b - root)
    t0 = c / q / size
    t1 = q / a / size
    return is_met, ti.select(t0 < t1, t0, t1), ti.select(t0 < t1, t1, t0)


@ti.func
def sphere_normal(o, d, centre, radius, t):
    """The outward unit normal at the entry of the ray, or at its exit if t is beyond the point nearest to the centre.

    The formula (l ∓ d √((r² − l·l)/a)) / r only has numbers of the size of the sphere, at any distance of the origin.
    """
    w, size = without_overflow(d)
    f = o - centre
    reciprocal = 1 / tm.dot(w, w)
    nearest = -tm.dot(f, w) * reciprocal
    l = f + nearest * w
    rest = radius * radius - tm.dot(l, l)
    half = ti.sqrt(ti.select(rest > 0, rest, 0) * reciprocal)
    n = l + ti.select(t * size <= nearest, -half, half) * w
    return ti.cast(n / n.norm(), float)


@ti.func
def longitude_latitude(n):
    """(u, v) in [0, 1]² of a unit vector: u around +y, v from the bottom, as in environments (A2-5)."""
    return tm.vec2(0.5 + azimuth(n.z, n.x) / (2 * tm.pi), 0.5 + latitude(n.y) / tm.pi)
