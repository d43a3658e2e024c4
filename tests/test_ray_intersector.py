"""The triangle tests as formulas: no leak, no scale of their own, nothing from rays that are none."""

import numpy as np
import pytest
from oracles import rays as oracle
from shapes import SQUARE, soup, sphere
from support import DEBUG, start

import taichi_tracer as tt
from taichi_tracer.ray_intersector import TRIANGLE_TESTS

COUNT = 4_000 if DEBUG else 100_000


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


def aimed_at_edges(rng, vertices, faces, count, inside=None):
    """Rays from near the centre to points on edges and to vertices, as exactly as f32 can say it."""
    corners = vertices[faces[rng.integers(0, len(faces), count)]]
    s = rng.uniform(size=(count, 1))
    s[: count // 4] = 0
    s[count // 4 : count // 2] = 0.5
    target = corners[:, 0] * (1 - s) + corners[:, 1] * s
    centre = vertices.mean(axis=0)
    origin = (centre + 0.1 * rng.normal(size=(count, 3))).astype(np.float32)
    return origin, (target - origin).astype(np.float32)


@pytest.mark.parametrize("offset", [0.0, 1e2, 1e4, 1e6])
def test_watertight_lets_nothing_through_a_closed_mesh(offset, rng):
    """From inside, through edges and vertices, wherever the mesh is: every ray hits.

    At 1e6 the sphere is larger: f32 would put three vertices of a small one on a line, and so a gap between triangles.
    """
    vertices, faces = sphere(40, 21, radius=max(1, offset / 2.5e5), centre=(offset, -offset / 3, offset / 7))
    vertices = vertices.astype(np.float32)
    scene = tt.scene_from_mesh(vertices, faces)
    assert scene.dropped == 0
    hits = scene.intersect(*aimed_at_edges(rng, vertices, faces, COUNT))
    assert (~hits.is_hit).sum() == 0


def test_moller_trumbore_leaks_where_watertight_does_not(rng):
    """Why the default is what it is: the same rays, the other test (a check that the rays above are hard)."""
    vertices, faces = sphere(40, 21)
    vertices = vertices.astype(np.float32)
    rays = aimed_at_edges(rng, vertices, faces, 100_000)
    leaks = {
        t: (~tt.scene_from_mesh(vertices, faces, triangle_test=t).intersect(*rays).is_hit).sum() for t in TRIANGLE_TESTS
    }
    assert leaks["watertight"] == 0
    assert leaks["moller_trumbore"] > 0


@pytest.mark.parametrize("test", TRIANGLE_TESTS)
@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1.0, 1e6, 1e12])
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


@pytest.mark.parametrize("test", TRIANGLE_TESTS)
@pytest.mark.parametrize("name", ["f32", "f64"])
def test_agrees_with_the_oracle(test, name, rng):
    """Hit, id, t, u, v of random rays on random triangles, but where float64 itself is within rounding of an edge."""
    start(name)
    vertices, faces = soup(rng, 80)
    vertices = vertices.astype(np.float32).astype(np.float64)
    origins = rng.uniform(-2, 2, (COUNT // 10, 3)).astype(np.float32)
    directions = rng.normal(size=origins.shape).astype(np.float32)
    hits = tt.scene_from_mesh(vertices, faces, triangle_test=test, intersector="brute_force").intersect(
        origins, directions
    )
    ids, t, u, v, margin = oracle.nearest(origins, directions, vertices, faces)
    sure = margin > (1e-3 if name == "f32" else 1e-11)
    assert sure.mean() > 0.9
    np.testing.assert_array_equal(hits.triangle_id[sure], ids[sure])
    found = sure & (ids >= 0)
    tolerance = {"f32": 2e-3, "f64": 1e-9}[name]  # grazing hits; most are far better
    np.testing.assert_allclose(hits.distance[found], t[found], rtol=tolerance)
    assert np.median(np.abs(hits.distance[found] / t[found] - 1)) < {"f32": 3e-7, "f64": 1e-15}[name]
    np.testing.assert_allclose(hits.barycentric_coords[found], np.stack([u, v], 1)[found], atol=tolerance)
    start("f32")


@pytest.mark.parametrize("test", TRIANGLE_TESTS)
@pytest.mark.parametrize("intersector", ["bvh", "brute_force"])
def test_rays_that_are_none_miss(test, intersector):
    scene = tt.scene_from_mesh(*SQUARE, triangle_test=test, intersector=intersector)
    bad = [
        ([0, 0, 1], [0, 0, 0]),
        ([0, 0, 1], [0, 0, np.nan]),
        ([0, 0, 1], [0, 0, -np.inf]),
        ([np.nan, 0, 1], [0, 0, -1]),
        ([0, np.inf, 1], [0, 0, -1]),
    ]
    hits = scene.intersect(*np.array(bad, np.float32).transpose(1, 0, 2))
    assert not hits.is_hit.any()
    assert (hits.triangle_id == -1).all()
    assert not scene.occluded(*np.array(bad, np.float32).transpose(1, 0, 2)).any()


@pytest.mark.parametrize("test", TRIANGLE_TESTS)
def test_direction_length_only_scales_t(test):
    scene = tt.scene_from_mesh(*SQUARE, triangle_test=test)
    for length in (1e-10, 1e-3, 1.0, 1e10):
        hit = scene.intersect([0.3, 0.1, 2], [0, 0, -length])
        assert hit.is_hit[0]
        np.testing.assert_allclose(hit.distance[0] * length, 2, rtol=1e-6)


def test_a_ray_in_the_plane_of_a_triangle_meets_nothing_there():
    scene = tt.scene_from_mesh(*SQUARE)
    assert not scene.intersect([-5, 0.1, 0], [1, 0, 0]).is_hit[0]


def test_both_sides_are_hit_and_told_apart():
    scene = tt.scene_from_mesh(*SQUARE)
    front, back = scene.intersect([0.3, 0.1, 1], [0, 0, -1]), scene.intersect([0.3, 0.1, -1], [0, 0, 1])
    assert not front.is_backfacing[0]
    assert back.is_backfacing[0]
    np.testing.assert_array_equal(front.normal[0], [0, 0, 1])
    np.testing.assert_array_equal(back.normal[0], [0, 0, -1])


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


def test_what_lies_behind_the_origin_is_never_a_hit(rng):
    """From just above a large triangle, whose plane f32 cannot tell from the origin: no distance is negative."""
    vertices, faces = soup(rng, 60, size=1e6)
    scene = tt.scene_from_mesh(vertices, faces, intersector="brute_force")
    corners = vertices.astype(np.float32).astype(np.float64)[faces[rng.integers(0, len(faces), COUNT // 5)]]
    weights = rng.dirichlet((1, 1, 1), len(corners))
    origins = (corners * weights[:, :, None]).sum(axis=1)
    hits = scene.intersect(origins, rng.normal(size=origins.shape))
    assert (hits.distance > 0).all()
