"""One triangle, one sphere, the nearest of all: what a hit is, what follows from a replaced method, what is no ray."""

from dataclasses import dataclass

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import put, vec3
from shapes import SQUARE, soup, sphere
from support import DEBUG

import taichi_tracer as tt
from taichi_tracer.ray import HitData, Ray
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.system import runtime

COUNT = 4_000 if DEBUG else 100_000
MEMBERS = 20


pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def _hit_data(
    intersector: ti.template(),
    method: ti.template(),
    o: ti.types.ndarray(ndim=2),
    d: ti.types.ndarray(ndim=2),
    out: ti.types.ndarray(ndim=2),
):
    for i in range(o.shape[0]):
        ray = Ray(origin=vec3(o, i, 0), direction=vec3(d, i, 0))
        hit = HitData()
        if ti.static(method == "query_ray"):
            hit = intersector.query_ray(ray)
        elif ti.static(method == "query_segment"):
            hit = intersector.query_segment(ray, 0.25, 1.75)
        else:
            hit = intersector.intersect_triangle(ray, 0)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = hit.is_hit, hit.is_backfacing, hit.triangle_id, hit.distance
        out[i, 4], out[i, 5], out[i, 6] = hit.barycentric_coords.x, hit.barycentric_coords.y, hit.material_id
        put(out, i, 7, hit.normal)
        put(out, i, 10, hit.geometric_normal)
        put(out, i, 13, hit.position)
        put(out, i, 16, hit.position_error)
        out[i, 19] = intersector.is_occluded(ray, 1.5)


@dataclass
class Hits:
    """The members of ``HitData``, a row for each ray; ``occluded`` is ``is_occluded`` before t = 1.5."""

    is_hit: np.ndarray
    is_backfacing: np.ndarray
    triangle_id: np.ndarray
    distance: np.ndarray
    u: np.ndarray
    v: np.ndarray
    material_id: np.ndarray
    normal: np.ndarray
    geometric_normal: np.ndarray
    position: np.ndarray
    position_error: np.ndarray
    occluded: np.ndarray


def hit_data(scene, origins, directions, method="query_ray"):
    """What a method of the intersector returns in a kernel."""
    o = np.atleast_2d(np.asarray(origins, runtime.dtype()))
    d = np.ascontiguousarray(np.broadcast_to(np.asarray(directions, runtime.dtype()), o.shape))
    out = np.zeros((len(o), MEMBERS), runtime.dtype())
    _hit_data(scene.ray_intersector, method, o, d, out)
    return Hits(*out[:, :7].T, *np.split(out[:, 7:19], 4, axis=1), out[:, 19])


def test_the_error_of_a_position_bounds_it(precision, rng):
    """Of random triangles: |position − exact| stays below ``position_error`` in every component."""
    vertices, faces = soup(rng, 300)
    vertices = vertices.astype(np.float32).astype(float) * 10.0 ** np.repeat(rng.integers(-3, 4, 300), 3)[:, None]
    vertices = vertices.astype(np.float32).astype(float)
    scene = tt.scene_from_mesh(vertices, faces)
    targets = (vertices[faces] * rng.dirichlet((1, 1, 1), 300)[:, :, None]).sum(axis=1)
    origins = targets + rng.normal(size=(300, 3)) * np.abs(targets).max(axis=1, keepdims=True)
    hits = hit_data(scene, origins, targets - origins)
    hit = hits.is_hit > 0
    assert hit.mean() > 0.9
    corners = vertices[faces[hits.triangle_id[hit].astype(int)]]
    u, v = hits.u[hit, None].astype(np.longdouble), hits.v[hit, None].astype(np.longdouble)
    exact = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    assert (np.abs(hits.position[hit] - exact) <= hits.position_error[hit]).all()


# ── what follows from a replaced method ──


@ti.data_oriented
class OnlyTriangles(RayIntersector):
    """A student's: every triangle is a disc's height z, hit where its id is even; the handout's members alone."""

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        hit = HitData()
        t = (self.geometry.triangle(triangle_id)[0].z - ray.origin.z) / ray.direction.z
        if triangle_id % 2 == 0 and t > self.EPSILON:
            hit.is_hit = 1
            hit.triangle_id = triangle_id
            hit.distance = t
            hit.material_id = 3
        return hit


@ti.data_oriented
class OnlyNearest(RayIntersector):
    """A student's: a wall at z = 0, in front of everything."""

    @ti.func
    def query_ray(self, ray):
        hit = HitData()
        hit.distance = tm.inf
        t = -ray.origin.z / ray.direction.z
        if t > 0:
            hit.is_hit = 1
            hit.triangle_id = 1
            hit.distance = t
        return hit


def stack_of_squares():
    """Squares at z = 0, 1 and 2, two triangles each."""
    vertices = np.concatenate([SQUARE[0] + [0, 0, z] for z in range(3)])
    return vertices, np.concatenate([SQUARE[1] + 4 * k for k in range(3)])


def test_a_triangle_test_of_ones_own_decides_every_answer(precision):
    """The nearest hit, t_min and t_max, and what is in the way; the plane and the point on it are filled in."""
    scene = tt.scene_from_mesh(*stack_of_squares(), intersector=OnlyTriangles)
    hits = hit_data(scene, [[7.0, 7.0, 5.0], [7.0, 7.0, 0.5]], [0, 0, -1])
    np.testing.assert_array_equal(hits.triangle_id, [4, 0])
    np.testing.assert_array_equal(hits.distance, [3, 0.5])
    np.testing.assert_array_equal(hits.material_id, [3, 3])
    np.testing.assert_array_equal(hits.geometric_normal, [[0, 0, 1]] * 2)
    np.testing.assert_array_equal(hits.position, [[7, 7, 2], [7, 7, 0]])
    assert (hits.position_error[:, 2] > 0).all()
    np.testing.assert_array_equal(hits.occluded, [0, 1])
    asked = scene.intersect([7.0, 7, 5], [0, 0, -1], t_min=[0, 3, 4.5, 0], t_max=[np.inf, np.inf, np.inf, 2.5])
    np.testing.assert_array_equal(asked.triangle_id, [4, 2, 0, -1])
    np.testing.assert_array_equal(
        scene.occluded([7.0, 7, 5], [0, 0, -1], t_min=[0, 5.5, 3.5], t_max=[2, 9, 4.5]), [False, False, True]
    )


def test_a_query_of_ones_own_decides_every_answer(precision):
    """It knows no t_min: it is asked from the point r(t_min) on, and t counts from the ray's own origin."""
    scene = tt.scene_from_mesh(*stack_of_squares(), intersector=OnlyNearest)
    hits = hit_data(scene, [[0.5, 0.25, 5.0], [0.5, 0.25, 1.0], [0.5, 0.25, 1.0]], [[0, 0, -1], [0, 0, -1], [0, 0, 1]])
    np.testing.assert_array_equal(hits.is_hit, [1, 1, 0])
    np.testing.assert_array_equal(hits.distance, [5, 1, np.inf])
    np.testing.assert_array_equal(hits.occluded, [0, 1, 0])
    window = hit_data(scene, [[0, 0, 1.0], [0, 0, 2.0], [0, 0, 0.125]], [0, 0, -1], "query_segment")
    np.testing.assert_array_equal(window.is_hit, [1, 0, 0])  # between t = 0.25 and t = 1.75
    np.testing.assert_array_equal(window.distance, [1, np.inf, np.inf])
    np.testing.assert_array_equal(
        scene.occluded([0, 0, 2], [0, 0, -1], t_min=[0, 0, 2.5], t_max=[2.5, 1.5, 3]), [True, False, False]
    )


@pytest.mark.parametrize("intersector", ["bvh", "brute_force"])
def test_a_march_from_hit_to_hit_ends(intersector, rng):
    """t_min = the last t: t grows, and every surface is met once, though t is rounded once more when it is returned."""
    vertices, faces = sphere(12, 7, 2.0, (-48, 16, 0))
    scene = tt.scene_from_mesh(vertices, faces, intersector=intersector)
    count = COUNT // 10
    origins = (rng.normal(size=(count, 3)) * 3 + [-48, 16, 0]).astype(np.float32)
    directions = (rng.normal(size=(count, 3)) * 1.5 + [-48, 16, 0] - origins).astype(np.float32)
    t = np.zeros(count, np.float32)
    for _ in range(8):
        hits = scene.intersect(origins, directions, t_min=np.where(np.isfinite(t), t, np.inf))
        assert (hits.distance > t)[np.isfinite(t)].all()
        t = hits.distance
    assert not hits.is_hit.any()
