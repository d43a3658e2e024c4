"""Analytic spheres against the closed form and against triangles, near and far, from outside and inside."""

import numpy as np
import taichi as ti
import taichi.math as tm
from oracles import spheres as oracle
from probe import ask, put, vec3
from shapes import random_rays, random_spheres, with_spheres

import taichi_tracer as tt
from taichi_tracer.formulas import spheres as formulas
from taichi_tracer.ray import Ray, offset_origin
from taichi_tracer.system import runtime


@ti.func
def _roots(rows: ti.template(), out: ti.template(), i):
    o, d, c, r = vec3(rows, i, 0), vec3(rows, i, 3), vec3(rows, i, 6), rows[i, 9]
    is_met, t_in, t_out = formulas.sphere_roots(o, d, c, r)
    out[i, 0], out[i, 1], out[i, 2] = ti.cast(is_met, ti.i32), t_in, t_out
    put(out, i, 3, formulas.sphere_normal(o, d, c, r, t_in))
    put(out, i, 6, formulas.sphere_normal(o, d, c, r, t_out))


def test_roots_and_normals_are_those_of_the_equation(precision, rng):
    """|o + t d − c| = r, for directions of all lengths; t_in ≤ t_out."""
    spheres = random_spheres(rng, 5_000)
    origins, directions = random_rays(rng, 5_000)
    aims = spheres[:, :3] + 0.8 * spheres[:, 3:] * rng.normal(size=(5_000, 3)) - origins
    directions = (aims * np.abs(directions).max(axis=1, keepdims=True)).astype(np.float32)
    found = ask(_roots, np.column_stack([origins, directions, spheres]), 9).astype(float)
    expected = [oracle.roots(o, d, s[:3], s[3]) for o, d, s in zip(origins, directions, spheres, strict=True)]
    t_in, t_out, gap = (np.array(part, float) for part in zip(*expected, strict=True))
    clear = np.abs(gap) > 1e-3
    np.testing.assert_array_equal(found[clear, 0] != 0, gap[clear] <= 0)
    met = clear & (gap < 0)
    assert 0.2 < met.mean() < 0.9
    rounding = (1e-4 if precision == "f32" else 1e-12) * (1 + np.abs(origins - spheres[:, :3]).max(axis=1))
    for column, t in ((1, t_in), (2, t_out)):
        length = np.linalg.norm(directions.astype(float), axis=1)
        assert (np.abs(found[:, column] - t) * length <= rounding)[met].all()
        exact = (origins + t[:, None] * directions.astype(float) - spheres[:, :3]) / spheres[:, 3:]
        normal = found[:, 3 * column : 3 * column + 3]
        assert (np.abs(normal - exact).max(axis=1) * spheres[:, 3] <= 10 * rounding)[met].all()


@ti.func
def _longitude_latitude(rows: ti.template(), out: ti.template(), i):
    uv = formulas.longitude_latitude(vec3(rows, i, 0))
    out[i, 0], out[i, 1] = uv.x, uv.y


def test_longitude_begins_at_minus_x_and_latitude_at_the_bottom(precision):
    directions = [[1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0.6, 0.8, 0]]
    found = ask(_longitude_latitude, directions, 2)
    expected = [[0.5, 0.5], [0.5, 1], [0.5, 0], [0.75, 0.5], [0.25, 0.5], [0.5, 0.5 + np.arcsin(0.8) / np.pi]]
    np.testing.assert_allclose(found, expected, atol=4 * runtime.epsilon())


def scene_of(*spheres, **options):
    return tt.SceneData(with_spheres(spheres), **options)


def test_tangents_and_near_misses_are_decided_as_exact_numbers_are(f32, rng):
    """One step of f32 beside the silhouette: what rational arithmetic says, every time."""
    centre, radius = np.float32([0.5, -1.25, 3.0]), np.float32(0.75)
    angle = rng.uniform(0, 2 * np.pi, 400)
    origins = np.stack([np.cos(angle), np.sin(angle), np.full(400, -2.0)], axis=1) * [radius, radius, 1] + centre
    origins = origins.astype(np.float32)
    origins[::2] = np.nextafter(origins[::2], np.float32(np.inf))
    directions = np.tile(np.float32([0, 0, 1]), (400, 1))
    found = scene_of((*centre, radius)).intersect(origins, directions).is_hit
    expected = [oracle.discriminant_sign(o, d, centre, radius) >= 0 for o, d in zip(origins, directions, strict=True)]
    np.testing.assert_array_equal(found, expected)
    assert 0.1 < found.mean() < 0.9
    assert scene_of((0, 0, 0, 1)).intersect([0, 1, -5], [0, 0, 1]).is_hit[0]  # the tangent itself
    assert not scene_of((0, 0, 0, 1)).intersect([0, 1.0000001, -5], [0, 0, 1]).is_hit[0]


def test_a_small_sphere_far_away_is_hit_right(precision, rng):
    """Radius 1 at a distance of 1e6: outline, depth and normal are those of the numbers that the ray has."""
    distance = 1e6
    scene = scene_of((distance, 0, 0, 1))
    origins = np.zeros((3_000, 3), np.float32)
    origins[:, 1:] = rng.uniform(-1.2, 1.2, (3_000, 2))
    hits = scene.intersect(origins, np.float32([1, 0, 0]))
    inside = (origins.astype(float) ** 2).sum(axis=1) <= 1
    margin = np.abs((origins.astype(float) ** 2).sum(axis=1) - 1) > 1e-6
    np.testing.assert_array_equal(hits.is_hit[margin], inside[margin])
    hit = hits.is_hit
    depth = np.sqrt(np.maximum(0, 1 - (origins[hit].astype(float) ** 2).sum(axis=1)))
    np.testing.assert_allclose(hits.distance[hit], distance - depth, rtol=2 * runtime.epsilon())
    np.testing.assert_allclose(hits.normal[hit][:, 1:], origins[hit][:, 1:], atol=1e-6)


@ti.func
def _meets(intersector: ti.template(), ray, primitive_id):
    """(t, u, v, whether the ray meets a primitive)."""
    t, u, v = intersector.try_primitive(ray, intersector.ray_bounds(ray), primitive_id, 0.0)
    return t, u, v, t > 0


@ti.kernel
def _leave(
    intersector: ti.template(),
    ids: ti.types.ndarray(),
    o: ti.types.ndarray(),
    d: ti.types.ndarray(),
    away: ti.types.ndarray(),
    met: ti.types.ndarray(),
):
    for i in range(o.shape[0]):
        ray = Ray(origin=tm.vec3(o[i, 0], o[i, 1], o[i, 2]), direction=tm.vec3(d[i, 0], d[i, 1], d[i, 2]))
        t, u, v, is_met = _meets(intersector, ray, ids[i])
        met[i] = is_met
        data = intersector.describe(ray, t, ids[i], u, v)
        if is_met and data.is_backfacing == 0:
            start = offset_origin(data.position, data.position_error, data.geometric_normal)
            direction = tm.vec3(away[i, 0], away[i, 1], away[i, 2])
            if tm.dot(direction, data.geometric_normal) < 0:
                direction = -direction
            _, _, _, is_met_again = _meets(intersector, Ray(origin=start, direction=direction), ids[i])
            if is_met_again:
                met[i] = 2


def test_a_ray_that_leaves_a_sphere_does_not_meet_it_again(f32, rng):
    """1,000 spheres of radius 10^U[−6, 6], as far from the origin as 10^U[−6, 6]: shadow rays start off the surface."""
    radius = 10.0 ** rng.uniform(-6, 6, (1_000, 1))
    centre = rng.normal(size=(1_000, 3)) * 10.0 ** rng.uniform(-6, 6, (1_000, 1))
    scene = scene_of(*np.concatenate([centre, radius], axis=1))
    ids = np.repeat(np.arange(1_000, dtype=np.int32), 100)
    aim = centre[ids] + radius[ids] * rng.normal(size=(len(ids), 3)) * 0.4
    origins = (centre[ids] + 5 * radius[ids] * rng.normal(size=(len(ids), 3))).astype(np.float32)
    away, met = rng.normal(size=(len(ids), 3)).astype(np.float32), np.zeros(len(ids), np.int32)
    _leave(scene.ray_intersector, ids, origins, (aim - origins).astype(np.float32), away, met)
    assert (met == 1).mean() > 0.5
    assert not (met == 2).any()


def test_ties_go_to_the_first(f32):
    scene = tt.SceneData(with_spheres([(0, 0, 0, 1)] * 5))
    assert scene.intersect([0, 0, 5], [0, 0, -1]).triangle_id[0] == 0


def test_rays_that_are_none_miss(f32):
    hits = scene_of((0, 0, 0, 1)).intersect(
        [[np.nan, 0, 0], [0, 0, 5], [np.inf, 0, 0]], [[0, 0, 1], [0, 0, 0], [1, 0, 0]]
    )
    assert not hits.is_hit.any()
