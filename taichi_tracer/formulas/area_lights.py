"""Points on triangles and directions to spheres, for lights that have an area. Each function states its density."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.frames import from_frame


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
def cone_of_sphere(distance, radius):
    """1 − cos θ of the cone in which a sphere is seen from a distance > radius to its centre (PBR, 4th edition, 6.2.4).

    It is sin²θ / (1 + cos θ), which keeps its digits if the sphere is small.
    """
    sine_squared = (radius / distance) ** 2
    return sine_squared / (1 + ti.sqrt(ti.max(0.0, 1 - sine_squared)))


@ti.func
def uniform_cone(axis, one_minus_cosine, xi):
    """A direction uniform in a cone around ``axis``; pdf 1/(2π (1 − cos θ)) per solid angle."""
    drop = xi.x * one_minus_cosine
    sine = ti.sqrt(ti.max(0.0, drop * (2 - drop)))
    return from_frame(axis, 1 - drop, sine, 2 * tm.pi * xi.y)
