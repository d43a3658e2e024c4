"""``scene.intersect`` and ``scene.occluded`` beside a search of all triangles with numpy in float64."""

import numpy as np
import pytest

import taichi_tracer as tt

NEAR_EDGE = 1e-4  # barycentric: rays that pass so close to an edge are not compared


def soup(seed=4, triangles=60):
    """Triangles at random in the cube [−1, 1]³."""
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-1, 1, (triangles, 1, 3))
    corners = (centers + rng.normal(0, 0.35, (triangles, 3, 3))).astype(np.float32)
    return corners.reshape(-1, 3).astype(float), np.arange(3 * triangles).reshape(-1, 3)


def rays(seed=5, count=3000):
    """Origins about and in the cube, and directions of any length towards points of it."""
    rng = np.random.default_rng(seed)
    origins = rng.uniform(-2, 2, (count, 3)).astype(np.float32)
    directions = (rng.uniform(-1, 1, (count, 3)) - origins) * np.exp(0.3 * rng.normal(size=(count, 1)))
    return origins.astype(float), directions.astype(np.float32).astype(float)


def search(corners, origins, directions, t_min=0.0, t_max=np.inf):
    """Distances and ids of the nearest hits, u and v there, and which rays pass no edge closely."""
    v0, v1, v2 = corners[:, 0], corners[:, 1], corners[:, 2]
    across = np.cross(directions[:, None], (v2 - v0)[None])
    det = np.einsum("tk,rtk->rt", v1 - v0, across)
    away = origins[:, None] - v0[None]
    other = np.cross(away, (v1 - v0)[None])
    u = np.einsum("rtk,rtk->rt", away, across) / det
    v = np.einsum("rk,rtk->rt", directions, other) / det
    t = np.einsum("tk,rtk->rt", v2 - v0, other) / det
    low, high = np.broadcast_to(t_min, len(t))[:, None], np.broadcast_to(t_max, len(t))[:, None]
    margin = np.minimum(np.minimum(u, v), 1 - u - v)
    inside = (margin >= 0) & (t > low) & (t < high)
    clear = (abs(margin) > NEAR_EDGE) & (abs(t - low) > 1e-4) & (abs(t - high) > 1e-4) | (t < low - 1)
    t = np.where(inside, t, np.inf)
    ids = t.argmin(1)
    rows = np.arange(len(t))
    hit = np.isfinite(t[rows, ids])
    two = np.sort(t, 1)[:, :2]
    with np.errstate(invalid="ignore"):
        clear = clear.all(1) & ~(two[:, 1] - two[:, 0] < 1e-4)
    return np.where(hit, t[rows, ids], np.inf), np.where(hit, ids, -1), u[rows, ids], v[rows, ids], clear


@pytest.fixture(scope="module")
def corners():
    """(60, 3, 3)."""
    vertices, faces = soup()
    return vertices[faces]


@pytest.fixture(scope="module")
def scene():
    """The triangles, as a scene."""
    return tt.scene_from_mesh(*soup())


@pytest.mark.parametrize("options", [{}, {"intersector": "brute_force", "triangle_test": "moller_trumbore"}])
def test_the_nearest_hits(corners, options):
    hits = tt.scene_from_mesh(*soup(), **options).intersect(*rays())
    distance, ids, u, v, clear = search(corners, *rays())
    assert clear.mean() > 0.9
    assert 0.3 < np.isfinite(distance[clear]).mean() < 0.95
    assert np.array_equal(hits.triangle_id[clear], ids[clear])
    assert np.array_equal(hits.is_hit, hits.triangle_id >= 0)
    hit = clear & hits.is_hit
    assert np.allclose(hits.distance[hit], distance[hit], rtol=1e-4, atol=1e-5)
    assert np.isinf(hits.distance[~hits.is_hit]).all()
    assert np.allclose(hits.barycentric_coords[hit], np.stack([u, v], 1)[hit], atol=2e-3)
    origins, directions = rays()
    assert np.allclose(hits.points[hit], (origins + distance[:, None] * directions)[hit], atol=1e-3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    behind = np.einsum("rk,rk->r", normals[ids], directions) > 0
    assert np.array_equal(hits.is_backfacing[hit], behind[hit])
    assert np.allclose(hits.normal[hit], np.where(behind, -1, 1)[hit, None] * normals[ids][hit], atol=1e-3)


@pytest.mark.parametrize(("t_min", "t_max"), [(0.0, 0.4), (0.5, np.inf), (0.3, 0.9), ("each", "each")])
def test_only_hits_between_t_min_and_t_max_count(corners, scene, t_min, t_max):
    rng = np.random.default_rng(1)
    if t_min == "each":
        t_min, t_max = rng.uniform(0, 0.5, 3000), rng.uniform(0.5, 2, 3000)
    distance, ids, _, _, clear = search(corners, *rays(), t_min, t_max)
    hits, blocked = scene.intersect(*rays(), t_min, t_max), scene.occluded(*rays(), t_min, t_max)
    assert clear.mean() > 0.8
    assert np.array_equal(hits.triangle_id[clear], ids[clear])
    assert np.array_equal(blocked[clear], ids[clear] >= 0)
    assert 0.1 < blocked.mean() < 0.9


def test_distance_is_in_units_of_the_direction(scene):
    origins, directions = rays()
    once, twice = scene.intersect(origins, directions), scene.intersect(origins, 4 * directions)
    assert np.array_equal(once.triangle_id, twice.triangle_id)
    assert np.allclose(once.distance[once.is_hit], 4 * twice.distance[once.is_hit], rtol=1e-5)


def test_rays_that_are_none_miss(scene):
    broken = np.array([[0, 0, 0], [np.nan, 0, 1], [0, np.inf, 0]])
    hits = scene.intersect(np.zeros((3, 3)), broken)
    assert not hits.is_hit.any()
    assert (hits.triangle_id == -1).all()
    assert not scene.occluded(np.zeros((3, 3)), broken).any()
    assert len(scene.intersect(np.zeros((0, 3)), np.zeros((0, 3)))) == 0


def test_one_ray_has_one_row(scene):
    hits = scene.intersect([0, 0, -5], [0, 0, 1])
    assert len(hits) == 1
    assert set(hits.to_dict()) >= {"is_hit", "distance", "triangle_id", "normal_x", "material_id"}


def test_the_rays_of_the_camera_hit_what_the_picture_shows():
    scene = tt.load_scene_data("cornell_box")
    renderer = tt.A1Renderer(scene_data=scene, width=32, height=24)
    x, y = np.meshgrid(np.arange(32), np.arange(24), indexing="xy")
    hits = scene.intersect(*renderer.camera.rays(x.ravel(), y.ravel()))
    seen = renderer.aov("triangle_id")
    assert seen.shape == (24, 32)
    assert np.array_equal(hits.triangle_id.reshape(24, 32)[::-1], seen)
    assert np.allclose(hits.distance.reshape(24, 32)[::-1], renderer.aov("distance"), rtol=1e-5)


def test_ids_follow_the_order_of_the_file():
    corners = [[-1, 0, 0], [1, 0, 0], [0, 1, 1], [0, 1, -1]]
    tent = tt.scene_from_mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    below = tent.intersect([[0, 0.2, 5], [0, 0.2, -5]], [[0, 0, -1], [0, 0, 1]])
    assert below.triangle_id.tolist() == [0, 1]
