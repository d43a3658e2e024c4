"""Frames around a direction, and the mirrored direction. All vectors have unit length."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.angles import on_circle


@ti.func
def frame_about(n):
    """Two unit vectors that form a right-handed frame with the unit vector n (Duff et al., JCGT 6(1), 2017)."""
    sign = ti.select(n.z >= 0, 1.0, -1.0)
    a = -1 / (sign + n.z)
    b = n.x * n.y * a
    return tm.vec3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x), tm.vec3(b, sign + n.y * n.y * a, -n.y)


@ti.func
def from_frame(n, cosine, sine, turn):
    """The unit vector at an angle θ from n, which is given by cos θ and sin θ, and at an azimuth, in full turns."""
    x_axis, y_axis = frame_about(n)
    x, y = on_circle(turn)
    return sine * x * x_axis + sine * y * y_axis + cosine * n


@ti.func
def mirrored(w_o, n):
    """ω_r = 2 (n·ω_o) n − ω_o."""
    return 2 * tm.dot(n, w_o) * n - w_o
