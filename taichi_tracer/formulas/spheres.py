"""Where a ray meets a sphere: the closed form, in an order of operations that keeps its digits."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.system import runtime


@ti.func
def widened(x):
    """``x`` in f64 where kernels run in f32 and can: then hits and misses are those of the exact numbers."""
    if ti.static(runtime.can_widen()):
        return ti.cast(x, ti.f64)
    else:  # noqa: RET505 (Taichi compiles one of the two)
        return x


@ti.func
def nearest_to_centre(o, d, centre):
    """l = f + (b/a) d and t = b/a, with f = o − c, a = d·d, b = −f·d: the point of the line nearest to the centre, seen
    from it (Haines, Günther & Akenine-Möller, "Precision improvements for ray/sphere intersection", Ray Tracing Gems,
    2019, chapter 7)."""
    f = o - centre
    t = -tm.dot(f, d) / tm.dot(d, d)
    return f + t * d, t


@ti.func
def sphere_roots(o, d, centre, radius):
    """Solve  |o + t d − c| = r  (Haines et al. 2019, section 7.3).

    Returns (is_met, t_in, t_out); t_in ≤ t_out. The discriminant is r² − l·l, of two numbers of the sphere's own size:
    b² − a c would lose a small sphere that is far away. The root with the smaller |t| comes from c/q, where the usual
    formula cancels.

    d is scaled by its largest component, so that no length of it overflows.
    """
    largest = abs(d).max()
    w = d / largest
    l, foot = nearest_to_centre(o, w, centre)
    f = o - centre
    a = tm.dot(w, w)
    b = -tm.dot(f, w)
    c = tm.dot(f, f) - radius * radius
    discriminant = radius * radius - tm.dot(l, l)
    is_met = discriminant >= 0

    root = ti.sqrt(a * ti.select(is_met, discriminant, 0))
    q = ti.select(b >= 0, b + root, b - root)
    t0 = c / q / largest
    t1 = q / a / largest
    return is_met, ti.select(t0 < t1, t0, t1), ti.select(t0 < t1, t1, t0)


@ti.func
def sphere_normal(o, d, centre, radius, t_in, t_out, t):
    """The outward unit normal where the ray enters or leaves, whichever is nearer to t.

    (l ∓ d √((r² − l·l)/a)) / r: of numbers of the sphere's size, however far the origin is.
    """
    w = d / abs(d).max()
    l, foot = nearest_to_centre(o, w, centre)
    a = tm.dot(w, w)
    rest = radius * radius - tm.dot(l, l)
    half = ti.sqrt(ti.select(rest > 0, rest, 0) / a)
    is_entry = abs(t - t_in) <= abs(t_out - t)
    n = l + ti.select(is_entry, -half, half) * w
    return ti.cast(n / n.norm(), float)


@ti.func
def longitude_latitude(n):
    """(u, v) in [0, 1]² of a unit vector: u around +y, v from the bottom, as environments have it (A2-5)."""
    return tm.vec2(0.5 + ti.atan2(n.z, n.x) / (2 * tm.pi), 0.5 + ti.asin(tm.clamp(n.y, -1, 1)) / tm.pi)
