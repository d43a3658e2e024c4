"""The wide tree: the answers of the plain hierarchy, and what it tells of itself."""

import numpy as np
import pytest
from compare import assert_same_answers
from shapes import SQUARE, random_rays, random_spheres, soup, sphere, with_spheres
from support import long_except

import taichi_tracer as tt
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.geometry import Mesh

pytestmark = pytest.mark.usefixtures("f32")


def test_facts_are_those_of_the_tree():
    scene = tt.load_scene_data("sphere")
    tree = scene.ray_intersector
    facts = tree.facts()
    assert list(facts) == ["nodes", "depth", "SAH cost", "build time", "tree memory"]
    assert facts["nodes"] == f"{tree.num_nodes:,}"
    assert 3 <= tree.depth <= 12
    assert 1 < tree.cost < 40
    bytes_per_triangle = tree.bytes / scene.num_triangles
    assert 36 < bytes_per_triangle <= 110
    assert facts["tree memory"].endswith(f"({bytes_per_triangle:.0f} bytes per triangle)")


@pytest.mark.parametrize("count", [1, 2, 9])
def test_the_stack_is_as_deep_as_the_tree_needs(count):
    vertices, faces = sphere(4 * count, 2 * count + 1)
    tree = tt.scene_from_mesh(vertices, faces).ray_intersector
    assert 1 <= tree.stack_size <= 8 * tree.depth


@pytest.mark.long
def test_a_destroyed_tree_leaves_others_alone():
    first, second = (tt.scene_from_mesh(*SQUARE) for _ in range(2))
    first.destroy()
    assert second.intersect([0, 0.1, 1], [0, 0, -1]).is_hit[0]
    np.testing.assert_array_equal(second.occluded([0, 0.1, 1], [0, 0, -1]), [True])


KINDS = ["culled triangles", "spheres", "culled triangles among spheres"]


@pytest.mark.long
@pytest.mark.parametrize("name", long_except(KINDS, "culled triangles among spheres"))
def test_special_primitives_are_met_as_by_the_plain_hierarchy(precision, name, rng):
    vertices, faces = soup(rng, 300)
    culls = np.arange(300) % 2 == 0 if "culled" in name else None
    spheres = random_spheres(rng, 200, 0.3)
    if "spheres" in name:
        mesh = with_spheres(spheres, vertices * 3, faces, face_culls=culls)
    else:
        mesh = Mesh(vertices * 3, faces, face_culls=culls)
    plain, wide = (tt.SceneData(mesh, fast=fast) for fast in (False, True))
    assert type(wide.ray_intersector) is WideBVH
    hits = assert_same_answers(plain, wide, *random_rays(rng, 8_000, reach=4))
    assert hits.is_hit.mean() > 0.05
    if "culled" in name:
        ids = np.setdiff1d(np.arange(mesh.num_primitives), mesh.sphere_ids)[culls]
        met = np.isin(hits.triangle_id, ids)
        assert met.any()
        assert not hits.is_backfacing[met].any()


@pytest.mark.long
@pytest.mark.parametrize("centre", [(0, 0, 0), (14837.5, 123.4, -22342.3)])
def test_spheres_among_triangles_equal_brute_force(f32, centre, rng):
    """Many rays, some from on the surfaces, near the origin and far from it."""
    vertices, faces = soup(rng, 80)
    spheres = random_spheres(rng, 60) + [*centre, 0]
    mesh = with_spheres(spheres, vertices * 3 + centre, faces, face_culls=np.arange(80) % 3 == 0)
    truth, scene = (tt.SceneData(mesh, intersector=i) for i in ("brute_force", "bvh"))
    origins, directions = random_rays(rng, 30_000)
    origins = (origins + np.asarray(centre)).astype(np.float32)
    distance = truth.intersect(origins, directions).distance[::5, None]
    origins[::5] += np.where(np.isfinite(distance), distance, 0) * directions[::5]  # on a surface
    expected = assert_same_answers(truth, scene, origins, directions)
    assert {1, 0} == set((np.isin(expected.triangle_id[expected.is_hit], mesh.sphere_ids)).astype(int))
    part = slice(0, 3_000)
    assert_same_answers(truth, scene, origins[part], directions[part], t_min=0.5, t_max=1.5)
