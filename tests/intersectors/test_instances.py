"""Objects in several places have the hits of their copies: in trees of groups, under all transforms, in both forms."""

from dataclasses import replace

import numpy as np
import pytest
from shapes import SQUARE, soup, sphere, with_spheres

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group
from taichi_tracer.intersectors.instances import boxes_of_places, rows_of_objects
from taichi_tracer.materials import Material, Texture
from taichi_tracer.picture.checkpoint import fingerprint
from taichi_tracer.scene_data import again

RAYS = 30_000


def in_f32(array):
    """The same numbers rounded to f32: then the corners of an object are the same in its copies."""
    return np.asarray(array, np.float32).astype(float)


def transforms(rng, count, kind="any"):
    """(count, 4, 4) matrices of one kind."""
    found = np.tile(np.eye(4), (count, 1, 1))
    turns, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    linear = {
        "moved": found[:, :3, :3],
        "turned": turns * np.sign(np.linalg.det(turns))[:, None, None],
        "mirrored": turns * -np.sign(np.linalg.det(turns))[:, None, None],
        "sheared": np.eye(3) + np.triu(rng.normal(size=(count, 3, 3)), 1),
        "a thousandth": 1e-3 * turns,
        "a thousand times": 1e3 * turns,
        "any": rng.normal(size=(count, 3, 3)),
    }[kind]
    found[:, :3, :3] = linear
    found[:, :3, 3] = rng.uniform(-3, 3, (count, 3)) * (1e3 if kind == "a thousand times" else 1)
    return found


def rays_at(scene, rng, count=RAYS, size=1.0):
    """Rays, half of which aim at corners of the places, and half anywhere."""
    low, high = scene.geometry.low, scene.geometry.high
    origins = rng.uniform(2 * low - high, 2 * high - low, (count, 3))
    directions = rng.normal(size=(count, 3))
    placed = scene.mesh.placed
    objects = [scene.mesh.vertices[placed.object(scene.mesh, k).faces.ravel()] for k in range(len(placed.faces) - 1)]
    points = placed.points([one[rng.integers(0, len(one), 200)] if len(one) else np.zeros((0, 3)) for one in objects])
    aimed = rng.permutation(len(directions))[: count // 2]
    at = points[rng.integers(0, len(points), len(aimed))]
    directions[aimed] = at + 0.05 * size * rng.normal(size=at.shape) - origins[aimed]
    return origins.astype(np.float32), directions.astype(np.float32)


def image_of(renderer, name):
    """A picture of a view, or what an AOV has."""
    if name == "normal":
        return renderer.use(name).render().image()
    return np.nan_to_num(renderer.aov(name))


def both(mesh, **options):
    """The scene with shared objects and the one with copies."""
    shared = tt.scene_from_mesh(mesh, instances="shared", **options)
    assert shared.effects.instances
    return shared, tt.scene_from_mesh(mesh, instances="copied", **options)


def assert_same_hits(shared, copied, origins, directions):
    """The same bits, except where a mirrored triangle has its corners in another order."""
    found, expected = shared.intersect(origins, directions), copied.intersect(origins, directions)
    assert 0.02 < expected.is_hit.mean() < 0.98
    for name in ("is_hit", "triangle_id", "distance", "is_backfacing", "material_id"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)
    size = np.abs(expected.position[expected.is_hit]).max()
    np.testing.assert_allclose(found.position, expected.position, atol=1e-5 * size)
    np.testing.assert_allclose(found.geometric_normal, expected.geometric_normal, atol=1e-4)
    np.testing.assert_allclose(found.normal, expected.normal, atol=1e-3)
    t_max = np.where(expected.is_hit, 1.5 * np.nan_to_num(expected.distance, posinf=1), 10).astype(np.float32)
    np.testing.assert_array_equal(shared.occluded(origins, directions, 0, t_max), expected.distance < t_max)


@pytest.mark.parametrize(
    "kind",
    [*("mirrored", "any")],
)
def test_every_place_has_the_hits_of_a_copy(kind, rng):
    vertices, faces = sphere(16, 9)
    ball = Mesh(in_f32(vertices), faces, source="ball")
    mesh = group([Instances(ball, transforms(rng, 12, kind)), Instances(Mesh(*SQUARE), transforms(rng, 2, kind))])
    scenes = both(mesh)
    sizes = {"a thousandth": 1e-3, "a thousand times": 1e3}
    assert_same_hits(*scenes, *rays_at(scenes[0], rng, size=sizes.get(kind, 1.0)))


def test_a_tree_of_three_levels_has_the_hits_of_its_flat_mesh(rng):
    mesh = Mesh(*map(in_f32, soup(rng, 200)), source="leaf")
    mesh.faces = mesh.faces.astype(np.int32)
    for level in range(3):
        own = Mesh(in_f32(soup(rng, 20)[0]), soup(rng, 20)[1], source=f"level {level}")
        mesh = group([own, Instances(mesh, transforms(rng, 3))], source=f"level {level}")
    scenes = both(mesh)
    assert scenes[0].num_triangles == scenes[1].num_triangles == 200 * 27 + 20 * (1 + 3 + 9)
    assert_same_hits(*scenes, *rays_at(scenes[0], rng))


def test_a_closed_object_has_no_gaps_in_any_place(rng):
    vertices, faces = sphere(48, 25)
    ball = Mesh(in_f32(vertices), faces, source="ball")
    places = transforms(rng, 8)
    shared, _ = both(group([Instances(ball, places)]))
    chosen = rng.integers(0, 8, 50_000)
    near = rng.uniform(-0.3, 0.3, (50_000, 3))
    inside = places[chosen, :3, 3] + np.einsum("nij,nj->ni", places[chosen, :3, :3], near)
    at_edges = ball.vertices[rng.integers(0, len(ball.vertices), 50_000)]
    at = places[chosen, :3, 3] + np.einsum("nij,nj->ni", places[chosen, :3, :3], at_edges)
    assert shared.intersect(inside, at - inside).is_hit.all()
    assert shared.occluded(inside, at - inside).all()


def test_what_ends_a_ray_does_not_hide_what_is_before_it():
    """The triangle at the end comes first in its leaf, and is no hit."""
    far, near = SQUARE[0], SQUARE[0] + (0, 0, 1)
    both_squares = Mesh(np.concatenate([far, near]), np.concatenate([SQUARE[1], SQUARE[1] + 4]))
    scene = tt.scene_from_mesh(group([Instances(both_squares, np.eye(4))]), instances="shared")
    origins = [[0.3, 0.1, 3], [0.3, 0.1, 3], [0.3, 0.1, 0.5]]
    assert scene.occluded(origins, [0, 0, -1], 0, [3, 2, 0.5]).tolist() == [True, False, False]


def test_spheres_become_ellipsoids(rng):
    """Against the equation |M⁻¹ (o + t d) − c| = r in float64."""
    centres, radii = rng.uniform(-1, 1, (3, 3)), np.array([0.3, 0.5, 0.8])
    balls = with_spheres(in_f32(np.column_stack([centres, radii])))
    places = transforms(rng, 5)
    scene = tt.scene_from_mesh(group([Instances(balls, places)]))
    assert scene.num_spheres == 15
    origins = rng.uniform(-8, 8, (20_000, 3)).astype(np.float32).astype(float)
    directions = rng.normal(size=(20_000, 3)).astype(np.float32).astype(float)
    best, number = np.full(20_000, np.inf), np.full(20_000, -1)
    for place, matrix in enumerate(places):
        inverse = np.linalg.inv(matrix)
        o, d = origins @ inverse[:3, :3].T + inverse[:3, 3], directions @ inverse[:3, :3].T
        for k, (*centre, radius) in enumerate(balls.spheres):
            f = o - centre
            a, b, c = (d * d).sum(axis=1), (f * d).sum(axis=1), (f * f).sum(axis=1) - radius**2
            root = np.sqrt(np.maximum(b * b - a * c, 0))
            t = np.where((-b - root) / a > 0, (-b - root) / a, (-b + root) / a)
            is_nearer = (b * b - a * c > 0) & (t > 0) & (t < best)
            best, number = np.where(is_nearer, t, best), np.where(is_nearer, 3 * place + k, number)
    hits = scene.intersect(origins, directions)
    clear = (hits.is_hit == (number >= 0)) & (hits.triangle_id == number)
    assert (~clear).sum() <= 5  # rays that graze an ellipsoid
    np.testing.assert_allclose(hits.distance[clear], best[clear], rtol=1e-4)
    met = clear & hits.is_hit
    inverse = np.linalg.inv(places)[number[met] // 3]
    own = np.einsum("nij,nj->ni", inverse[:, :3, :3], hits.position[met]) + inverse[:, :3, 3]
    away = own - balls.spheres[number[met] % 3, :3]
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), balls.spheres[number[met] % 3, 3], rtol=1e-4)
    normals = np.einsum("nji,nj->ni", inverse[:, :3, :3], away)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert (abs((normals * hits.normal[met]).sum(axis=1)) > 1 - 1e-4).all()


def test_normals_backs_and_holes_are_those_of_copies(rng):
    vertices, faces = sphere(24, 13)
    stripes = Texture(np.repeat(np.array([[[1.0], [0.0]]] * 2, np.float32), 3, axis=2))
    uv = np.stack([np.arctan2(vertices[:, 2], vertices[:, 0]), vertices[:, 1]], axis=1)[faces]
    ball = Mesh(
        in_f32(vertices),
        faces,
        normals=in_f32(vertices),
        face_normals=faces,
        materials=[Material("striped", map_d=stripes), Material("plain", Kd=(1, 0, 0))],
        face_materials=np.arange(len(faces), dtype=np.int32) % 2,
        face_culls=np.arange(len(faces)) % 5 == 0,
        corner_uv=uv,
        source="ball",
    )
    scenes = both(group([Instances(ball, transforms(rng, 9))]))
    effects = scenes[0].effects
    assert effects.holes
    assert effects.culling
    assert effects.interpolated_normals
    assert_same_hits(*scenes, *rays_at(scenes[0], rng))


@pytest.mark.parametrize("name", ["normal", "uv"])
def test_a_picture_of_shared_objects_is_that_of_copies(name, rng):
    checks = Texture(rng.uniform(size=(4, 4, 3)).astype(np.float32))
    square = Mesh(
        *SQUARE, materials=[Material(map_Kd=checks)], corner_uv=SQUARE[0][SQUARE[1]][:, :, :2], source="square"
    )
    ball = with_spheres([(0, 0, 1, 0.5)])  # whose poles turn only where it is shared
    parts = [Instances(square, transforms(rng, 5, "turned")), Instances(ball, transforms(rng, 3, "turned"))]
    mesh = group(parts if name == "normal" else parts[:1])
    pictures = []
    for scene in both(mesh, view={"eye": (0, 0, 12), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 40.0}):
        renderer = tt.A1Renderer(scene_data=scene, width=64, height=48)
        pictures.append(image_of(renderer, name))
    np.testing.assert_allclose(*pictures, atol=1e-5)
    assert pictures[0].std() > 0.05


def test_a_scene_can_be_made_again_with_another_intersector(rng):
    mesh = group([Instances(Mesh(*SQUARE, source="square"), transforms(rng, 3))])
    scene = tt.scene_from_mesh(mesh, instances="shared")
    same, plain = again(scene), again(scene, intersector="brute_force")
    assert same.effects.instances
    assert not plain.effects.instances
    assert fingerprint(scene) == fingerprint(same)
    moved = replace(mesh, instances=[Instances(mesh.instances[0].mesh, transforms(rng, 3))])
    assert fingerprint(tt.scene_from_mesh(moved, instances="shared")) != fingerprint(scene)


def test_nothing_in_any_place_is_a_scene():
    empty = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32), source="nothing")
    with pytest.warns(UserWarning, match="dropped"):
        scene = tt.scene_from_mesh(group([Instances(empty, np.tile(np.eye(4), (3, 1, 1)))]), instances="shared")
    assert not scene.intersect([0, 0, 1], [0, 0, -1]).is_hit.any()


def test_boxes_of_places_hold_everything_and_are_not_much_larger(rng):
    vertices, faces = soup(rng, 500)
    scene = tt.scene_from_mesh(group([Instances(Mesh(vertices, faces), transforms(rng, 6))]), instances="shared")
    placed, (ids, boxes) = scene.mesh.placed, scene.geometry.hittable()
    rows = rows_of_objects(scene.geometry, ids)
    assert [len(one) for one in rows] == [500]
    places, found = boxes_of_places(placed, [boxes[one] for one in rows], np.float64)
    for place, box in zip(places, found, strict=True):
        points = vertices @ placed.matrices[place, :, :3].T + placed.matrices[place, :, 3]
        assert (box[:3] <= points.min(axis=0) + 1e-5).all()
        assert (points.max(axis=0) <= box[3:] + 1e-5).all()
        assert np.prod(box[3:] - box[:3]) < 3 * np.prod(np.ptp(points, axis=0))
