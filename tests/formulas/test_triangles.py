"""The triangle tests as formulas: the closed form, no leak, no scale of their own; and the normal of a triangle."""

from fractions import Fraction

import numpy as np
import pytest
import taichi as ti
from probe import ask, put, vec3
from shapes import SQUARE, sphere
from support import DEBUG

import taichi_tracer as tt
from taichi_tracer.formulas import triangles
from taichi_tracer.system import runtime
from taichi_tracer.system.parts import PARTS

COUNT = 4_000 if DEBUG else 100_000
TESTS = ["watertight", "moller_trumbore"]


pytestmark = pytest.mark.usefixtures("f32")


# ── the formulas themselves ──


@ti.kernel
def _solve(solve: ti.template(), rows: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(rows.shape[0]):
        o, d, v0, v1, v2 = vec3(rows, i, 0), vec3(rows, i, 3), vec3(rows, i, 6), vec3(rows, i, 9), vec3(rows, i, 12)
        is_inside, t, u, v, det = solve(o, d, v0, v1, v2)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4] = ti.cast(is_inside, ti.i32), t, u, v, det


def solved(name, origins, directions, corners):
    """(is_inside, t, u, v, det), each (N,), of (N, 3) rays on (N, 3, 3) triangles."""
    rows = np.column_stack([origins, directions, corners.reshape(-1, 9)]).astype(runtime.dtype())
    out = np.zeros((len(rows), 5), runtime.dtype())
    _solve(PARTS.find("triangle test", name).solve, rows, out)
    return out[:, 0] != 0, *out[:, 1:].T


def random_pairs(rng, count):
    """Rays at triangles: (origins, directions, corners), t, u, v, det; of f32 numbers, most hit and some miss."""
    corners = rng.normal(size=(count, 3, 3)).astype(np.float32).astype(float)
    origins = rng.uniform(-3, 3, (count, 3)).astype(np.float32).astype(float)
    weights = rng.dirichlet((1, 1, 1), count) * 1.6 - 0.2
    directions = (corners * weights[:, :, None]).sum(axis=1) - origins
    directions = (directions * 10.0 ** rng.uniform(-3, 3, (count, 1))).astype(np.float32).astype(float)
    e1, e2, s = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], origins - corners[:, 0]
    matrix = np.stack([-directions, e1, e2], axis=2)
    t, u, v = np.linalg.solve(matrix, s[:, :, None])[:, :, 0].T
    return (origins, directions, corners), t, u, v, np.linalg.det(matrix)


@pytest.mark.parametrize("test", TESTS)
def test_it_solves_the_equation(precision, test, rng):
    """o + t d = (1 − u − v) v0 + u v1 + v v2; det is that of the equation, positive where the ray meets the front."""
    arguments, t, u, v, det = random_pairs(rng, 20_000)
    inside, found_t, found_u, found_v, found_det = solved(test, *arguments)
    size = np.linalg.norm(arguments[1], axis=1)
    good = np.abs(det) > 0.1 * size  # no grazing rays, whose numbers are worse conditioned
    assert good.mean() > 0.5
    tolerance = 2e-4 if precision == "f32" else 1e-11
    np.testing.assert_allclose(found_t[good] * size[good], (t * size)[good], atol=tolerance)
    np.testing.assert_allclose(found_u[good], u[good], atol=tolerance)
    np.testing.assert_allclose(found_v[good], v[good], atol=tolerance)
    np.testing.assert_allclose(found_det[good], det[good], rtol=tolerance)
    margin = np.minimum(np.minimum(u, v), 1 - u - v)
    sure = good & (np.abs(margin) > tolerance)
    np.testing.assert_array_equal(inside[sure], margin[sure] > 0)
    assert 0.2 < inside[sure].mean() < 0.9


@pytest.mark.parametrize("test", TESTS)
def test_edges_and_vertices_belong_to_the_triangle(test):
    corners = np.tile([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]], (7, 1, 1))
    places = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0, 0.5], [0.5, 0.5], [0.25, 0.25]])
    origins = np.column_stack([places, np.full(7, 2.0)])
    inside, t, u, v, det = solved(test, origins, np.tile([0.0, 0, -1], (7, 1)), corners)
    assert inside.all()
    np.testing.assert_array_equal(t, 2)
    np.testing.assert_array_equal(np.column_stack([u, v]), places)
    np.testing.assert_array_equal(det, 1)
    inside, *_ = solved(test, origins + [1.0001, 0, 0], np.tile([0.0, 0, -1], (7, 1)), corners)
    assert not inside[0]


@pytest.mark.parametrize("test", TESTS)
def test_a_parallel_ray_has_no_determinant(test):
    *_, det = solved(test, np.zeros((1, 3)), np.array([[1.0, 0, 0]]), np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]]))
    assert det[0] == 0


def test_neighbours_compute_the_same_number_for_their_edge(rng):
    """Every ray through an edge that two triangles share is inside one of them, whichever way the edge is listed."""
    count = COUNT // 4
    a, b, left, right = rng.normal(size=(4, count, 3)).astype(np.float32)
    origins = rng.normal(size=(count, 3)).astype(np.float32) * 3
    along = rng.uniform(0.05, 0.95, (count, 1)).astype(np.float32)
    directions = a + along * (b - a) - origins
    first, *_ = solved("watertight", origins, directions, np.stack([a, b, left], axis=1))
    for corners in ((b, a, right), (a, right, b), (right, b, a)):
        second, *_ = solved("watertight", origins, directions, np.stack(corners, axis=1))
        other_side = (np.cross(a - origins, b - origins) * (left - origins)).sum(1) * (
            np.cross(a - origins, b - origins) * (right - origins)
        ).sum(1) < 0
        assert other_side.mean() > 0.2
        assert (first | second)[other_side].all()


@ti.func
def _shear_axes(rows: ti.template(), out: ti.template(), i):
    x_axis, y_axis = triangles.shear_axes(vec3(rows, i, 0))
    put(out, i, 0, x_axis)
    put(out, i, 3, y_axis)


def test_shear_axes_project_along_the_ray(precision, rng):
    """x·d = y·d = 0, and of the plane of d's two smaller axes they are unit vectors."""
    d = np.concatenate([rng.normal(size=(1_000, 3)), np.eye(3), -np.eye(3), [[1, 1, 1], [1, 1, 0], [0, -2, 2]]])
    out = ask(_shear_axes, d, 6).astype(float)
    x, y = out[:, :3], out[:, 3:]
    tolerance = 4 * runtime.epsilon() * np.abs(d).max()
    np.testing.assert_allclose((x * d).sum(axis=1), 0, atol=tolerance)
    np.testing.assert_allclose((y * d).sum(axis=1), 0, atol=tolerance)
    largest = np.abs(np.cross(x, y)).max(axis=1)
    np.testing.assert_allclose(largest, 1, atol=1e-6)
    assert (np.abs(np.cross(x, y)).argmax(axis=1) == np.abs(d).argmax(axis=1))[:1_006].all()


@ti.func
def _exact_difference(rows: ti.template(), out: ti.template(), i):
    out[i, 0] = triangles.exact_difference(rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3])


def test_a_difference_of_products_has_the_right_sign(rng):
    """In rational numbers, where f32 products cancel to nothing or are too small for f32."""
    p, q = (rng.normal(size=(2, 3_000)) * 10.0 ** rng.integers(-18, 18, (2, 3_000))).astype(np.float32)
    numbers = np.stack([p, q, np.nextafter(q, np.float32(np.inf)), np.nextafter(p, np.float32(-np.inf))], axis=1)
    numbers[::5, 2:] = numbers[::5, :2]  # equal products
    numbers[1::5] = numbers[1::5] * np.float32(1e-20)
    found = ask(_exact_difference, numbers, 1)[:, 0]
    exact = [Fraction(a) * Fraction(b) - Fraction(c) * Fraction(d) for a, b, c, d in numbers.astype(float).tolist()]
    assert [np.sign(x) for x in found] == [(x > 0) - (x < 0) for x in exact]
    assert (found == 0).sum() >= 600


@ti.func
def _normals(rows: ti.template(), out: ti.template(), i):
    v0, v1, v2 = vec3(rows, i, 0), vec3(rows, i, 3), vec3(rows, i, 6)
    put(out, i, 0, triangles.stable_normal(v0, v1, v2))
    put(out, i, 3, triangles.unit(triangles.stable_normal(v0, v1, v2)))
    out[i, 6] = triangles.thinness(v0, v1, v2)


def test_normals_are_those_of_the_cross_product_whichever_edges_are_shortest(precision, rng):
    corners = rng.normal(size=(3_000, 3, 3)).astype(np.float32).astype(float)
    out = ask(_normals, corners.reshape(-1, 9), 7).astype(float)
    exact = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    tolerance = 2e-5 if precision == "f32" else 1e-12
    np.testing.assert_allclose(out[:, :3], exact, atol=tolerance)
    length = np.linalg.norm(exact, axis=1, keepdims=True)
    np.testing.assert_allclose(out[:, 3:6] * np.minimum(length, 1), exact / np.maximum(length, 1), atol=tolerance)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    shortest = np.sort(edges, axis=1)[:, :2].prod(axis=1)
    np.testing.assert_allclose(out[:, 6], shortest / length[:, 0], rtol=1e-2 if precision == "f32" else 1e-9)
    assert out[:, 6].min() >= 1 - 1e-6


@pytest.mark.parametrize("scale", [1e-15, 1.0, 1e18])
def test_a_sliver_of_any_size_has_the_normal_of_its_plane(scale):
    """From the two shortest edges: the third loses what the sliver is thin by. In f32 smaller products are 0."""
    corners = np.array([[0, 0, 0], [1, 1e-5, 0], [1 - 1e-3, 2e-5, 0]]) * scale
    (out,) = ask(_normals, corners.reshape(1, 9), 7)
    np.testing.assert_allclose(out[3:6], [0, 0, 1], atol=1e-6)


@ti.func
def _plane_distance(rows: ti.template(), out: ti.template(), i):
    o, d, v0, v1, v2 = vec3(rows, i, 0), vec3(rows, i, 3), vec3(rows, i, 6), vec3(rows, i, 9), vec3(rows, i, 12)
    out[i, 0] = triangles.plane_distance(o, d, v0, v1, v2)


def test_the_distance_to_a_plane_is_the_nearest_f32(rng):
    """Also of an origin that f32 cannot tell from the plane, where the quotient of f32 numbers is noise."""
    arguments, *_ = random_pairs(rng, 2_000)
    origins, directions, corners = arguments
    weights = rng.dirichlet((1, 1, 1), 2_000)[::2]
    origins[::2] = ((corners[::2] * weights[:, :, None]).sum(axis=1)).astype(np.float32)  # on the plane, but for f32
    found = ask(_plane_distance, np.column_stack([origins, directions, corners.reshape(-1, 9)]), 1)[:, 0]
    o, d, c = (np.asarray(a, np.longdouble) for a in (origins, directions, corners))
    n = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    exact = ((c[:, 0] - o) * n).sum(axis=1) / (d * n).sum(axis=1)
    rounding_in_f64 = 1e-15 * np.abs((c[:, 0] - o) * n).sum(axis=1) / np.abs((d * n).sum(axis=1))
    assert (np.abs(found - exact) <= 2.0**-24 * np.abs(exact) + rounding_in_f64).all()


# ── the formulas in scenes ──


def aimed_at_edges(rng, vertices, faces, count):
    """Rays from near the centre to points on edges and to vertices, as exactly as f32 can say it."""
    corners = vertices[faces[rng.integers(0, len(faces), count)]]
    s = rng.uniform(size=(count, 1))
    s[: count // 4] = 0
    s[count // 4 : count // 2] = 0.5
    target = corners[:, 0] * (1 - s) + corners[:, 1] * s
    centre = vertices.mean(axis=0)
    origin = (centre + 0.1 * rng.normal(size=(count, 3))).astype(np.float32)
    return origin, (target - origin).astype(np.float32)


def test_moller_trumbore_leaks_where_watertight_does_not(rng):
    """Why the default is what it is: the same rays, the other test (a check that the rays above are hard)."""
    vertices, faces = sphere(40, 21)
    vertices = vertices.astype(np.float32)
    rays = aimed_at_edges(rng, vertices, faces, 100_000)
    leaks = {t: (~tt.scene_from_mesh(vertices, faces, triangle_test=t).intersect(*rays).is_hit).sum() for t in TESTS}
    assert leaks["watertight"] == 0
    assert leaks["moller_trumbore"] > 0


@pytest.mark.parametrize("test", TESTS)
@pytest.mark.parametrize("scale", [1e-12, 1000000000000.0])
def test_size_does_not_matter(test, scale, rng):
    """No ε of a size of its own deletes small triangles or thickens large ones (C-8)."""
    vertices, faces = (a.copy() for a in SQUARE)
    scene = tt.scene_from_mesh(vertices * scale, faces, triangle_test=test)
    target = rng.uniform(-2, 2, (500, 2))
    origins = np.concatenate([target, np.ones((500, 1))], axis=1) * scale
    hits = scene.intersect(origins, np.tile([0, 0, -scale], (500, 1)))
    inside = (np.abs(target.astype(np.float32)) < 1 - 1e-6).all(axis=1)
    outside = (np.abs(target) > 1 + 1e-6).any(axis=1)
    assert hits.is_hit[inside].all()
    assert not hits.is_hit[outside].any()
    np.testing.assert_allclose(hits.distance[inside], 1, rtol=1e-6)
