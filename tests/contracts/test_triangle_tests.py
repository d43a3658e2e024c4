"""Every registered triangle test keeps its contract in each precision; those that break it in one point are found."""

import taichi as ti
import taichi.math as tm
from support import start

from contracts.registered import broken_parts, check_fails, check_part, every
from taichi_tracer.formulas.triangles import TriangleTest, moller_trumbore


@every("triangle test")
def test_triangle_test(precision, part):
    check_part(part)


@ti.func
def swapped(o, d, v0, v1, v2):
    is_inside, t, u, v, det = moller_trumbore(o, d, v0, v1, v2)
    return is_inside, t, v, u, det


@ti.func
def with_epsilon(o, d, v0, v1, v2):
    """The determinant scales with the square of the size: a fixed ε removes small triangles."""
    is_inside, t, u, v, det = moller_trumbore(o, d, v0, v1, v2)
    return is_inside and abs(det) > 1e-7, t, u, v, det


@ti.func
def one_sided(o, d, v0, v1, v2):
    is_inside, t, u, v, det = moller_trumbore(o, d, v0, v1, v2)
    return is_inside and det > 0, t, u, v, det


@ti.func
def a_parallelogram(o, d, v0, v1, v2):
    is_inside, t, u, v, det = moller_trumbore(o, d, v0, v1, v2)
    return u >= 0 and v >= 0 and u <= 1 and v <= 1, t, u, v, det


@ti.func
def in_unit_lengths(o, d, v0, v1, v2):
    """t counts in units of length instead of in lengths of the direction."""
    is_inside, t, u, v, det = moller_trumbore(o, tm.normalize(d), v0, v1, v2)
    return is_inside, t, u, v, det


@ti.func
def turned_round(o, d, v0, v1, v2):
    is_inside, t, u, v, det = moller_trumbore(o, d, v0, v1, v2)
    return is_inside, t, u, v, -det


@ti.func
def never_parallel(o, d, v0, v1, v2):
    is_inside, t, u, v, det = moller_trumbore(o, d, v0, v1, v2)
    parallel = det == 0
    return is_inside or parallel, ti.select(parallel, 0.0, t), u, v, ti.select(parallel, 1e-20, det)


@broken_parts(
    {
        TriangleTest("broken: u and v swapped", swapped): "u is .* not",
        TriangleTest("broken: a fixed epsilon", with_epsilon): "is_inside is False, not True",
        TriangleTest("broken: front sides alone", one_sided): "is_inside is False, not True",
        TriangleTest("broken: a parallelogram", a_parallelogram): "is_inside is True, not False",
        TriangleTest("broken: t in units of length", in_unit_lengths): "t is .* not",
        TriangleTest("broken: det turned round", turned_round): "the sign of det",
        TriangleTest("broken: parallel rays hit", never_parallel): "parallel to the plane",
    }
)
def test_broken_triangle_test_is_found(broken, reason):
    start("f32")
    check_fails(broken, check_part, reason)
