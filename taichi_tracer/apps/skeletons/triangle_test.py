"""A triangle test: where a ray meets the plane of a triangle, and whether that is inside."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Mine(tt.TriangleTest):
    """o + t d = (1 − u − v) v0 + u v1 + v v2, solved by Cramer's rule.

    All points are in world space. d may have any length, and t is in units of it. The search decides what a hit is: a
    test takes any t, and needs no tolerance.
    """

    name = "mine"

    @ti.func
    def solve(self, o, d, v0, v1, v2):
        """(is_inside, t, u, v, det); det is above 0 if the triangle faces the ray, and 0 if the ray is parallel."""
        e1, e2, s = v1 - v0, v2 - v0, o - v0
        n = tm.cross(e1, e2)
        m = tm.cross(s, d)
        det = -tm.dot(d, n)
        u, v, t = tm.dot(e2, m) / det, -tm.dot(e1, m) / det, tm.dot(s, n) / det
        return u >= 0 and v >= 0 and u + v <= 1, t, u, v, det
