"""Angles of directions, and directions of angles: short polynomials in f32, the functions of Taichi in f64.

In f32, Taichi's functions are calls of the C library, before which LLVM stores what it keeps in registers, and which it
makes even where nobody uses the result. The polynomials are ordinary arithmetic: ``azimuth`` takes half the time of
``ti.atan2``, and ``on_circle`` makes a sample of direct light about 5 % shorter. ``azimuth`` and ``latitude`` also work
on vectors, for many numbers at once.
"""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.system import runtime


@ti.func
def on_circle(turn):
    """(cos 2πt, sin 2πt) for an angle t that is given in full turns; in f32 with errors below 1e-7 for 0 ≤ t < 1.

    The nearest quarter of a turn is subtracted, which rounds nothing. What is left is at most an eighth of a turn; the
    polynomials for it are those of Moshier's Cephes library.
    """
    if ti.static(runtime.current().precision == "f64"):
        return ti.cos(2 * tm.pi * turn), ti.sin(2 * tm.pi * turn)
    quarters = ti.floor(4 * turn + 0.5)
    x = 2 * tm.pi * (turn - 0.25 * quarters)
    z = x * x
    s = x + x * z * (-0.16666654611 + z * (0.0083321608736 - z * 0.00019515295891))
    c = 1 - 0.5 * z + z * z * (0.04166664568298827 + z * (-0.001388731625493765 + z * 0.00002443315711809948))
    k = ti.cast(quarters, ti.i32)
    is_odd = (k & 1) == 1
    cosine, sine = ti.select(is_odd, s, c), ti.select(is_odd, c, s)
    return ti.select(((k + 1) & 2) == 2, -cosine, cosine), ti.select((k & 2) == 2, -sine, sine)


@ti.func
def azimuth(y, x):
    """atan2(y, x); in f32 with an error below 3e-7.

    The polynomial is Abramowitz & Stegun 4.4.49, for atan on [0, 1], with its terms added in pairs.
    """
    if ti.static(runtime.current().precision == "f64"):
        return ti.atan2(y, x)
    a, b = abs(x), abs(y)
    high, low = ti.select(a > b, a, b), ti.select(a > b, b, a)
    t = low / ti.select(high > 0, high, 1.0)
    s = t * t
    s2 = s * s
    p01, p23 = 1 - 0.3333314528 * s, 0.1999355085 - 0.1420889944 * s
    p45, p67 = 0.1065626393 - 0.0752896400 * s, 0.0429096138 - 0.0161657367 * s
    angle = t * (p01 + s2 * (p23 + s2 * (p45 + s2 * (p67 + s2 * 0.0028662257))))
    angle = ti.select(b > a, tm.pi / 2 - angle, angle)
    angle = ti.select(x < 0, tm.pi - angle, angle)
    return ti.select(y < 0, -angle, angle)


@ti.func
def latitude(y):
    """asin y, for many numbers at once as for one; in f32 with an error below 3e-7. Beyond ±1, it is that of ±1.

    The polynomial for [0, 1/2] is that of Moshier's Cephes library. Beyond 1/2, asin y = π/2 − 2 asin √((1 − y)/2).
    """
    if ti.static(runtime.current().precision == "f64"):
        return ti.asin(tm.clamp(y, -1, 1))
    size = ti.select(abs(y) < 1, abs(y), 1.0)
    is_steep = size > 0.5
    z = ti.select(is_steep, 0.5 * (1 - size), size * size)
    x = ti.select(is_steep, ti.sqrt(z), size)
    angle = x + x * z * (
        0.16666752422 + z * (0.074953002686 + z * (0.045470025998 + z * (0.024181311049 + z * 0.042163199048)))
    )
    angle = ti.select(is_steep, tm.pi / 2 - 2 * angle, angle)
    return ti.select(y < 0, -angle, angle)
