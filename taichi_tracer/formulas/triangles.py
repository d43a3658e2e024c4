"""The intersection of a ray and a triangle: two published tests, and the triangle's own normal.

A triangle test is a formula. It solves an equation, and it says whether the ray passes inside the edges.
``RayIntersector`` decides whether this is a hit, in one place for all tests. Your own test is registered in the same
way as the tests here; after that, ``triangle_test=`` and ``--triangle-test`` accept its name.
"""

from collections.abc import Callable

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.roundings import rounded
from taichi_tracer.system import runtime
from taichi_tracer.system.parts import overridable, register


@ti.data_oriented
@overridable(solve="truth number number number number")
class TriangleTest:
    """A named triangle test: ``TriangleTest("mine", my_function)``, or a subclass that defines ``solve``.

    Args:
        name: the name that ``triangle_test=`` takes; None for the attribute of the class.
        solve: a ``@ti.func`` (o, d, v0, v1, v2), for the method of this name.
    """

    kind, name, required = "triangle test", "", ("solve",)

    def __init__(self, name: str | None = None, solve: Callable | None = None) -> None:
        self.name = name or self.name
        if solve is not None:
            self.solve = solve

    @ti.func
    def solve(self, o, d, v0, v1, v2):
        """(is_inside, t, u, v, det) of the ray o + t d and a triangle, see ``moller_trumbore``; all are scalars."""
        ti.static_assert(False, "a triangle test must say what solve(self, o, d, v0, v1, v2) is")


@ti.func
def moller_trumbore(o, d, v0, v1, v2):
    """Solve  o + t d = (1 − u − v) v0 + u v1 + v v2  by Cramer's rule (Möller & Trumbore 1997; A1-11).

    Returns (is_inside, t, u, v, det). det > 0 if the triangle faces the ray. If the ray is parallel to the triangle,
    det is 0, and t, u and v are not finite. There is no ε, because det scales with size²·|d|: a fixed ε would delete
    small triangles (C-8).
    """
    e1 = v1 - v0
    e2 = v2 - v0
    s = o - v0

    det = tm.dot(e1, tm.cross(d, e2))
    u = tm.dot(s, tm.cross(d, e2)) / det
    v = tm.dot(d, tm.cross(s, e1)) / det
    t = tm.dot(e2, tm.cross(s, e1)) / det

    is_inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return is_inside, t, u, v, det


@ti.func
def watertight(o, d, v0, v1, v2):
    """On which side of each projected edge does the ray pass? (Woop, Benthin & Wald, JCGT 2(1), 2013)

    Returns (is_inside, t, u, v, det) as ``moller_trumbore`` does. Two triangles that share an edge compute the same
    number for this edge, up to its sign. Therefore no ray passes between them. This needs products that are ``rounded``
    before they are subtracted.

    There are two deviations from the paper. First, t comes from the plane of the triangle, because the error of an
    interpolated t is proportional to the size of the triangle. Second, the projection is two dot products instead of a
    permutation of the axes, with the same rounding.
    """
    x_axis, y_axis = shear_axes(d)
    a = v0 - o
    b = v1 - o
    c = v2 - o
    ax, ay = tm.dot(x_axis, a), tm.dot(y_axis, a)
    bx, by = tm.dot(x_axis, b), tm.dot(y_axis, b)
    cx, cy = tm.dot(x_axis, c), tm.dot(y_axis, c)

    u_edge, v_edge, w_edge = edge_functions(ax, ay, bx, by, cx, cy)
    if ti.static(runtime.can_widen()):
        if u_edge == 0 or v_edge == 0 or w_edge == 0:  # products of f32 are exact in f64, so the signs are right
            u_edge, v_edge, w_edge = exact_edge_functions(ax, ay, bx, by, cx, cy)
    any_negative = u_edge < 0 or v_edge < 0 or w_edge < 0
    any_positive = u_edge > 0 or v_edge > 0 or w_edge > 0
    total = u_edge + v_edge + w_edge
    is_inside = total != 0 and not (any_negative and any_positive)

    n = stable_normal(v0, v1, v2)
    det = -tm.dot(d, n)
    t = -tm.dot(a, n) / det
    return is_inside, t, v_edge / total, w_edge / total, det


@ti.func
def edge_functions(ax, ay, bx, by, cx, cy):
    """Twice the signed areas of the projected triangles o b c, o c a and o a b: on which side of each edge o lies."""
    return (
        rounded(cx * by) - rounded(cy * bx),
        rounded(ax * cy) - rounded(ay * cx),
        rounded(bx * ay) - rounded(by * ax),
    )


@ti.func
def exact_edge_functions(ax, ay, bx, by, cx, cy):
    """``edge_functions`` with the right signs, see ``exact_difference``."""
    return exact_difference(cx, by, cy, bx), exact_difference(ax, cy, ay, cx), exact_difference(bx, ay, by, ax)


@ti.func
def shear_axes(d):
    """Two axes x, y with x·d = y·d = 0. Their dot products project along d onto the plane of d's two smaller axes."""
    is_x = abs(d.x) > abs(d.y) and abs(d.x) > abs(d.z)
    is_y = abs(d.y) > abs(d.z)
    largest = ti.select(is_x, d.x, ti.select(is_y, d.y, d.z))
    x, y, z = -d.x / largest, -d.y / largest, -d.z / largest
    x_axis = ti.select(is_x, tm.vec3(y, 1, 0), ti.select(is_y, tm.vec3(0, z, 1), tm.vec3(1, 0, x)))
    y_axis = ti.select(is_x, tm.vec3(z, 0, 1), ti.select(is_y, tm.vec3(1, x, 0), tm.vec3(0, 1, y)))
    return x_axis, y_axis


@ti.func
def exact_difference(p, q, r, s):
    """p q − r s of f32 numbers with the right sign, computed in f64, where the products are exact.

    A result that is too small for f32 becomes the smallest normal number with the same sign.
    """
    exact = ti.cast(p, ti.f64) * ti.cast(q, ti.f64) - ti.cast(r, ti.f64) * ti.cast(s, ti.f64)
    rounded = ti.cast(exact, ti.f32)
    if rounded == 0 and exact != 0:
        rounded = tm.sign(exact) * ti.static(runtime.smallest())
    return rounded


@ti.func
def plane_distance(o, d, v0, v1, v2):
    """t where the ray meets the triangle's plane, computed in f64 and rounded to f32; accurate even near the plane."""
    a = ti.cast(v0, ti.f64) - ti.cast(o, ti.f64)
    n = tm.cross(ti.cast(v1, ti.f64) - ti.cast(v0, ti.f64), ti.cast(v2, ti.f64) - ti.cast(v0, ti.f64))
    return ti.cast(tm.dot(a, n) / tm.dot(ti.cast(d, ti.f64), n), ti.f32)


@ti.func
def stable_normal(v0, v1, v2):
    """(v1 − v0) × (v2 − v0), computed from the two shortest edges: for a sliver, they lose the least to rounding."""
    e0 = v1 - v0
    e1 = v2 - v1
    e2 = v0 - v2
    l0, l1, l2 = tm.dot(e0, e0), tm.dot(e1, e1), tm.dot(e2, e2)
    is_0_longest = l0 >= l1 and l0 >= l2
    is_1_longest = l1 >= l2
    p = ti.select(is_0_longest, e1, ti.select(is_1_longest, e2, e0))
    q = ti.select(is_0_longest, e2, ti.select(is_1_longest, e0, e1))
    return tm.cross(p, q)


@ti.func
def unit(v):
    """v / |v|. First v is divided by its largest component, so that |v|² neither overflows nor underflows."""
    return tm.normalize(v / tm.component_max(abs(v)))


@ti.func
def thinness(v0, v1, v2):
    """1/sin of the angle between the two shortest edges, ≥ 1: the factor by which rounding errors of a normal grow."""
    a, b, c = tm.length(v1 - v0), tm.length(v2 - v1), tm.length(v0 - v2)
    longest = ti.max(a, b, c)
    others = ti.select(longest == a, b * c, ti.select(longest == b, c * a, a * b))
    return others / tm.length(tm.cross(v1 - v0, v2 - v0))


register(TriangleTest("watertight", watertight))
register(TriangleTest("moller_trumbore", moller_trumbore))


# ── the same for arrays of triangles in numpy, with the same bits ──
# The corners v0, v1, v2 are (n, 3) arrays of one precision, in which the functions compute. Triangles without area give
# NaN, without a warning.


def unit_normals(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray) -> np.ndarray:
    """(n, 3) ``unit(stable_normal(v0, v1, v2))``: normals of length 1."""
    edges = np.stack([v1 - v0, v2 - v1, v0 - v2])
    with np.errstate(all="ignore"):
        longest = np.argmax([dot(e, e) for e in edges], axis=0)
        p, q = (edges[(longest + k) % 3, np.arange(len(v0))] for k in (1, 2))  # the two edges after the longest one
        normal = np.cross(p, q)
        x, y, z = abs(normal).T
        within_1 = normal / np.maximum(np.maximum(x, y), z)[:, None]
        return within_1 / norm(within_1)[:, None]


def thinness_of(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray) -> np.ndarray:
    """(n,) ``thinness(v0, v1, v2)``: 1/sin of the angle between the two shortest edges."""
    with np.errstate(all="ignore"):
        shortest, second, _ = np.sort([norm(v1 - v0), norm(v2 - v1), norm(v0 - v2)], axis=0)
        return shortest * second / norm(np.cross(v1 - v0, v2 - v0))


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,) dot products of (n, 3) vectors, added from left to right."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def norm(a: np.ndarray) -> np.ndarray:
    """(n,) lengths of (n, 3) vectors."""
    return np.sqrt(dot(a, a))
