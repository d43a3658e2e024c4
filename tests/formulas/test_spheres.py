"""Analytic spheres against the closed form and against triangles, and every way to look for them against the others."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import spheres as oracle
from shapes import soup
from shapes import sphere as triangulated

import taichi_tracer as tt
from taichi_tracer.camera import Camera
from taichi_tracer.fast.primary_hits import PrimaryHits
from taichi_tracer.geometry import Mesh
from taichi_tracer.ray import Ray, offset_origin
from taichi_tracer.scene_data import INTERSECTORS
from taichi_tracer.system import runtime

FIELDS = ("triangle_id", "distance", "barycentric_coords", "normal", "is_backfacing", "material_id")


def as_mesh(spheres, vertices=None, faces=None, **more):
    """Spheres, and triangles if there are any: in turn as long as both last, to mix their ids."""
    spheres = np.asarray(spheres, float).reshape(-1, 4)
    if faces is None:
        vertices, faces = np.zeros((1, 3)), np.zeros((0, 3), np.int32)
    total = len(spheres) + len(faces)
    sphere_ids = np.unique(np.linspace(0, total - 1, len(spheres)).astype(np.int32))
    assert len(sphere_ids) == len(spheres)
    rows = np.zeros((total, 3), np.int32)
    rows[np.setdiff1d(np.arange(total), sphere_ids)] = faces
    return Mesh(vertices=vertices, faces=rows, spheres=spheres, sphere_ids=sphere_ids, **more)


def scene_of(*spheres, **options):
    return tt.SceneData(as_mesh(spheres), **options)


def random_spheres(rng, count, size=1.0):
    spheres = np.concatenate([rng.uniform(-3, 3, (count, 3)), rng.uniform(0.05, size, (count, 1))], axis=1)
    return spheres.astype(np.float32).astype(float)


def random_rays(rng, count, reach=5):
    origins = rng.uniform(-reach, reach, (count, 3)).astype(np.float32)
    directions = (rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-6, 6, (count, 1))).astype(np.float32)
    directions[::9] *= [0, 0, 1]
    directions[1::9] *= np.float32([1, -0.0, 1])
    return origins, directions


def test_hits_are_those_of_the_closed_form(precision, rng):
    """From outside and inside, with directions of any length: distance and normal to the last digit but one."""
    spheres = random_spheres(rng, 30)
    origins, directions = random_rays(rng, 20_000)
    hits = tt.SceneData(as_mesh(spheres)).intersect(origins, directions)
    ids, t, normals, margin = oracle.nearest(origins, directions, spheres)
    clear = margin > 1e-9
    assert clear.mean() > 0.99
    np.testing.assert_array_equal(hits.triangle_id[clear], ids[clear])
    hit = clear & (ids >= 0)
    assert 0.1 < hit.mean() < 0.9
    epsilon = runtime.epsilon()
    np.testing.assert_allclose(hits.distance[hit], t[hit], rtol=2 * epsilon if precision == "f32" else 1e-8)
    outward = np.where(hits.is_backfacing[:, None], -hits.normal, hits.normal)
    np.testing.assert_allclose(outward[hit], normals[hit], atol=2 * epsilon if precision == "f32" else 1e-8)
    np.testing.assert_array_equal(hits.is_backfacing[hit], ((directions * normals).sum(axis=1) > 0)[hit])
    assert hits.is_backfacing[hit].mean() > 0.05


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in INTERSECTORS if name != "brute_force"])
@pytest.mark.parametrize("centre", [(0, 0, 0), (14837.5, 123.4, -22342.3)])
def test_spheres_among_triangles_equal_brute_force(f32, name, centre, rng):
    vertices, faces = soup(rng, 80)
    spheres = random_spheres(rng, 60) + [*centre, 0]
    mesh = as_mesh(spheres, vertices * 3 + centre, faces, face_culls=np.arange(140) % 3 == 0)
    truth, scene = (tt.SceneData(mesh, intersector=i) for i in ("brute_force", name))
    origins, directions = random_rays(rng, 30_000)
    origins = (origins + np.asarray(centre)).astype(np.float32)
    distance = truth.intersect(origins, directions).distance[::5, None]
    origins[::5] += np.where(np.isfinite(distance), distance, 0) * directions[::5]  # on a surface
    expected, found = truth.intersect(origins, directions), scene.intersect(origins, directions)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(found, field), getattr(expected, field), err_msg=field)
    assert {1, 0} == set((np.isin(expected.triangle_id[expected.is_hit], mesh.sphere_ids)).astype(int))
    np.testing.assert_array_equal(scene.occluded(origins, directions), expected.is_hit)
    part = slice(0, 3_000)
    window = {"t_min": 0.5, "t_max": 1.5}
    np.testing.assert_array_equal(
        scene.intersect(origins[part], directions[part], **window).distance,
        truth.intersect(origins[part], directions[part], **window).distance,
    )


def test_packets_equal_single_rays_bit_for_bit(f32, rng):
    vertices, faces = soup(rng, 80)
    scene = tt.SceneData(as_mesh(random_spheres(rng, 40, 0.4), vertices, faces, face_culls=np.arange(120) % 2 == 0))
    camera = Camera(45, 30, screen_window=(-1.5, 1.5, -1, 1))
    single, packets = (PrimaryHits(scene, camera, use_packets=use) for use in (False, True))
    for hits in (single, packets):
        hits.trace()
    for field in ("distance", "triangle_id", "u", "v"):
        a, b = (hits.to_image(field) for hits in (single, packets))
        np.testing.assert_array_equal(a, b, err_msg=field)
    assert len(np.unique(a)) > 1


@pytest.mark.long
@pytest.mark.parametrize("eye", [(0, 0, 4), (0.2, 0.1, 0.3)])
def test_a_sphere_is_its_own_fine_triangulation(f32, eye, rng):
    """From outside and inside: the same silhouette but for the facets' error, and normals as close as they are."""
    vertices, faces = triangulated(columns=400, rows=200)
    fine, exact = tt.scene_from_mesh(vertices, faces), scene_of((0, 0, 0, 1))
    directions = rng.normal(size=(5_000, 3)) - (0 if np.linalg.norm(eye) < 1 else [0, 0, 4])
    a, b = fine.intersect(eye, directions), exact.intersect(eye, directions)
    both = a.is_hit & b.is_hit
    assert (a.is_hit != b.is_hit).mean() < 2e-3
    assert both.mean() > 0.2
    steep = both & (np.abs((b.normal * directions).sum(axis=1)) > 0.2 * np.linalg.norm(directions, axis=1))
    np.testing.assert_allclose(a.distance[steep], b.distance[steep], rtol=3e-3)
    assert (a.normal[steep] * b.normal[steep]).sum(axis=1).min() > 0.999
    np.testing.assert_array_equal(a.is_backfacing[both], b.is_backfacing[both])


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


@ti.kernel
def _leave(
    scene: ti.template(),
    ids: ti.types.ndarray(),
    o: ti.types.ndarray(),
    d: ti.types.ndarray(),
    away: ti.types.ndarray(),
    met: ti.types.ndarray(),
):
    for i in range(o.shape[0]):
        ray = Ray(origin=tm.vec3(o[i, 0], o[i, 1], o[i, 2]), direction=tm.vec3(d[i, 0], d[i, 1], d[i, 2]))
        data = scene.ray_intersector.intersect_triangle(ray, ids[i])
        met[i] = data.is_hit
        if data.is_hit and data.is_backfacing == 0:
            position, error = scene.geometry.hit_position(data)
            start = offset_origin(position, error, data.geometric_normal)
            direction = tm.vec3(away[i, 0], away[i, 1], away[i, 2])
            if tm.dot(direction, data.geometric_normal) < 0:
                direction = -direction
            if scene.ray_intersector.intersect_triangle(Ray(origin=start, direction=direction), ids[i]).is_hit:
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
    _leave(scene, ids, origins, (aim - origins).astype(np.float32), away, met)
    assert (met == 1).mean() > 0.5
    assert not (met == 2).any()


def test_ties_go_to_the_first(f32):
    scene = tt.SceneData(as_mesh([(0, 0, 0, 1)] * 5))
    assert scene.intersect([0, 0, 5], [0, 0, -1]).triangle_id[0] == 0


def test_rays_that_are_none_miss(f32):
    hits = scene_of((0, 0, 0, 1)).intersect(
        [[np.nan, 0, 0], [0, 0, 5], [np.inf, 0, 0]], [[0, 0, 1], [0, 0, 0], [1, 0, 0]]
    )
    assert not hits.is_hit.any()


def test_spheres_that_cannot_be_are_dropped_and_told(f32):
    scene = scene_of((0, 0, 0, 1), (np.nan, 0, 0, 1), (0, 0, 0, 0), (0, 0, 0, -1))
    assert scene.dropped == 3
    assert "3 of 4 primitives dropped (1 with a NaN" in scene.notes[0]
    assert scene.intersect([0, 0, 5], [0, 0, -1]).distance[0] == 4


def test_only_a_scene_with_spheres_has_them_compiled(f32):
    plain = tt.load_scene_data("cube")
    assert not plain.effects.spheres
    assert not plain.geometry.has_spheres
    assert any(line.startswith("spheres") and "not simulated" in line for line in plain.effects.receipt())
    scene = scene_of((0, 0, 0, 1), (3, 0, 0, 1))
    assert scene.effects.spheres
    assert (scene.num_spheres, scene.num_triangles) == (2, 0)
    assert any(line.startswith("spheres") and line.endswith("simulated, 2 of them") for line in scene.effects.receipt())
    np.testing.assert_array_equal([scene.geometry.low, scene.geometry.high], [[-1, -1, -1], [4, 1, 1]])


def test_spheres_everywhere_change_no_bit_of_a_scene_without(f32, rng):
    vertices, faces = soup(rng, 100)
    plain, complete = (tt.scene_from_mesh(vertices, faces, effects_mode=mode) for mode in ("scene", "all"))
    assert complete.geometry.has_spheres
    origins, directions = random_rays(rng, 5_000)
    a, b = plain.intersect(origins, directions), complete.intersect(origins, directions)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(a, field), getattr(b, field), err_msg=field)


def test_a_furnace_holds_a_sphere_of_its_reflectance(f32):
    """Environment 1, reflectance 0.8, nothing occluded: radiance 0.8 everywhere on it, without any noise."""
    scene = scene_of((0, 0, 0, 1), environment="white")
    renderer = tt.A2Renderer(scene, 24, 24)
    image = renderer.use("brdf").render(4).image()
    np.testing.assert_allclose(image[8:16, 8:16], 0.8, atol=2e-6)
    assert set(np.unique(image.round(5))) <= {np.float32(x) for x in (0.8, 0.85, 0.9, 0.95, 1.0)}
