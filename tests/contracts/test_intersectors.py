"""Every intersector answers exactly as brute force: hit, t to the last bit, id, and whether anything is in the way."""

import numpy as np
import pytest
from shapes import SQUARE, lattice, soup, sphere
from support import DEBUG, data_file, start

import taichi_tracer as tt
from taichi_tracer.ray_intersector import TRIANGLE_TESTS
from taichi_tracer.scene_data import INTERSECTORS

ACCELERATORS = [name for name in INTERSECTORS if name != "brute_force"]
RAYS = 2_000 if DEBUG else 40_000


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


def rays_of_all_kinds(rng, vertices, faces, count):
    """Random, axis-parallel, grazing, aimed at vertices and edges, on the surface, and degenerate rays."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = np.maximum(high - low, 1e-3 * np.abs(vertices).max() + 1e-9)
    origins = rng.uniform(low - size, high + size, (count, 3))
    directions = rng.normal(size=(count, 3))
    part = np.array_split(np.arange(count), 10)
    corners = vertices[faces[rng.integers(0, len(faces), count)]]
    directions[part[0]] = corners[part[0], 0] - origins[part[0]]
    directions[part[1]] = (corners[part[1], 0] + corners[part[1], 1]) / 2 - origins[part[1]]
    directions[part[2]] *= [0, 0, 1]
    directions[part[3]] *= [1, -0.0, 1]
    origins[part[4]] = corners[part[4]].mean(axis=1)
    edge = corners[part[5], 1] - corners[part[5], 0]
    origins[part[5]] = corners[part[5], 0] - edge
    directions[part[5]] = edge * (1 + 1e-6 * rng.normal(size=edge.shape))
    origins[part[6]] = corners[part[6], 2] - [0, 0, 3]
    directions[part[6]] = [0, 0, 1]
    directions[part[7]] *= 10.0 ** rng.uniform(-10, 10, (len(part[7]), 1))
    directions[part[8][::7]] = 0
    directions[part[8][1::7]] = np.nan
    origins[part[8][2::7]] = np.inf
    directions[part[8][3::7]] = [np.inf, 0, 1]
    directions[part[8][4::7]] = [1, 1e-42, -1e-42]
    return origins, directions


def check_against_brute_force(name, test, vertices, faces, origins, directions, **window):
    """Fail with the first ray on which the two differ."""
    truth = tt.scene_from_mesh(vertices, faces, intersector="brute_force", triangle_test=test)
    scene = tt.scene_from_mesh(vertices, faces, intersector=name, triangle_test=test)
    expected, found = truth.intersect(origins, directions, **window), scene.intersect(origins, directions, **window)
    for field in ("triangle_id", "distance", "barycentric_coords", "normal", "is_backfacing"):
        a, b = getattr(expected, field), getattr(found, field)
        wrong = np.flatnonzero((a != b).reshape(len(a), -1).any(axis=1))
        assert len(wrong) == 0, (field, len(wrong), origins[wrong[0]], directions[wrong[0]], a[wrong[0]], b[wrong[0]])
    np.testing.assert_array_equal(truth.occluded(origins, directions, **window), expected.is_hit)
    np.testing.assert_array_equal(scene.occluded(origins, directions, **window), expected.is_hit)
    truth.destroy()
    scene.destroy()
    return expected


@pytest.mark.parametrize("test", TRIANGLE_TESTS)
@pytest.mark.parametrize("name", ACCELERATORS)
@pytest.mark.parametrize("shape", ["soup", "lattice", "sphere", "far", "mixed", "flat"])
def test_equals_brute_force(name, test, shape, rng):
    """Six meshes × 40,000 rays × two tests × intersectors: about 1e6 pairs in all."""
    vertices, faces = {
        "soup": lambda: soup(rng, 200),
        "lattice": lambda: lattice(rng, 60),
        "sphere": lambda: sphere(),
        "far": lambda: sphere(centre=(14837.5, 123.4, -22342.3)),
        "mixed": lambda: _mixed_sizes(rng),
        "flat": lambda: _flat(rng),
    }[shape]()
    vertices = vertices.astype(np.float32).astype(np.float64)
    count = RAYS * 2 if shape in ("soup", "sphere") else RAYS
    hits = check_against_brute_force(name, test, vertices, faces, *rays_of_all_kinds(rng, vertices, faces, count))
    assert hits.is_hit.mean() > 0.02


def _mixed_sizes(rng):
    parts = [soup(rng, 40, size=10.0**k) for k in (-6, -3, 0, 3, 6)]
    vertices = np.concatenate([v for v, _ in parts])
    return vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)


def _flat(rng):
    vertices, faces = soup(rng, 150)
    vertices[:, 1] = 0.25
    return vertices, faces


@pytest.mark.parametrize("name", ACCELERATORS)
def test_t_window_is_open(name, rng):
    vertices, faces = soup(rng, 100)
    origins, directions = rays_of_all_kinds(rng, vertices, faces, RAYS // 8)
    check_against_brute_force(name, "watertight", vertices, faces, origins, directions, t_min=0.5, t_max=1.5)
    square = tt.scene_from_mesh(*SQUARE, intersector=name)
    assert not square.intersect([0.2, 0.1, 1.0], [0, 0, -1], t_max=1.0).is_hit[0]
    assert not square.intersect([0.2, 0.1, 1.0], [0, 0, -1], t_min=1.0).is_hit[0]
    assert square.intersect([0.2, 0.1, 1.0], [0, 0, -1], t_min=0.999, t_max=1.001).is_hit[0]


def exponentially_spaced(count=73):
    """Triangles each twice as far and twice as large as the one before: the deepest tree per triangle."""
    base = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.5, 0.1]])
    vertices = np.concatenate([(base + 1) * 2.0 ** (k - 36) for k in range(count)])
    return vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def one_centroid(rng, count=50_000):
    """Triangles of different shape whose boxes all have the same centre."""
    half = rng.uniform(0.1, 1, (count, 3))
    half = np.round(half * 1024) / 1024
    corner = np.stack([-half, half, half * [1, -1, 1]], axis=1)
    return corner.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


@pytest.mark.parametrize("name", ACCELERATORS)
@pytest.mark.parametrize("shape", ["one_centroid", "identical", "exponential", "one"])
def test_hard_inputs_build(name, shape, rng):
    """The build ends, and the answers are right on rays that hit."""
    vertices, faces = {
        "one_centroid": lambda: one_centroid(rng, 5_000 if DEBUG else 50_000),
        "identical": lambda: (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.tile([[0, 1, 2]], (50_000, 1))),
        "exponential": exponentially_spaced,
        "one": lambda: (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])),
    }[shape]()
    origins, directions = rays_of_all_kinds(rng, vertices, faces, 200)
    hits = check_against_brute_force(name, "watertight", vertices, faces, origins, directions)
    assert hits.is_hit.any()
    if shape == "identical":  # ties go to the lowest id
        assert set(hits.triangle_id[hits.is_hit]) == {0}


@pytest.mark.parametrize("name", list(INTERSECTORS))
def test_nothing_to_hit(name):
    """No triangles, or none that a ray could meet."""
    for vertices, faces in (
        (np.zeros((0, 3)), np.zeros((0, 3), int)),
        (np.zeros((3, 3)), [[0, 1, 2]]),
        ([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    ):
        scene = tt.scene_from_mesh(vertices, faces, intersector=name)
        hits = scene.intersect([[0, 0, 1.0]], [[0, 0, -1.0]])
        assert not hits.is_hit[0]
        assert hits.triangle_id[0] == -1
        assert hits.distance[0] == np.inf
        assert not scene.occluded([[0, 0, 1.0]], [[0, 0, -1.0]])[0]


@pytest.mark.parametrize("name", ACCELERATORS)
@pytest.mark.parametrize("file", ["suzanne.ply", "Duck.glb", "featuretype.STL"])
def test_real_meshes(name, file, rng):
    from taichi_tracer.files import read

    mesh = read(data_file(file))
    origins, directions = rays_of_all_kinds(rng, mesh.vertices, mesh.faces, 300 if DEBUG else 5_000)
    hits = check_against_brute_force(name, "watertight", mesh.vertices, mesh.faces, origins, directions)
    assert hits.is_hit.any()
