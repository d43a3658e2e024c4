"""The fast form of objects in several places: the same bits as the plain one, however the upper tree is divided."""

import numpy as np
import pytest
from shapes import SQUARE, soup

import taichi_tracer as tt
from taichi_tracer.fast.bvh_wide import ABSENT, leaf_reference
from taichi_tracer.fast.wide_instances import _shifted
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group


def test_references_move_with_their_nodes_and_leaves():
    references = np.array([3, int(leaf_reference(np.int64(5), np.int64(9))), ABSENT])
    assert _shifted(references, 100, 7).tolist() == [10, int(leaf_reference(np.int64(105), np.int64(109))), ABSENT]


@pytest.mark.parametrize("count", [1, 9])
@pytest.mark.parametrize("is_scattered", [True, False], ids=["scattered", "in one place"])
def test_the_bits_are_those_of_the_plain_form(count, is_scattered, rng):
    """Places that coincide cannot be divided: they stand in one leaf. Several objects have one triangle or many."""
    transforms = np.tile(np.eye(4), (count, 1, 1))
    if is_scattered:
        transforms[:, :3] = rng.normal(size=(count, 3, 4))
    parts = [Instances(Mesh(*soup(rng, n), source=f"{n}"), transforms) for n in (1, 5, 300)]
    scenes = [tt.scene_from_mesh(group(parts), instances="shared", fast=fast) for fast in (True, False)]
    origins = rng.uniform(-3, 3, (20_000, 3))
    directions = rng.normal(size=(20_000, 3))
    t_min, t_max = rng.uniform(0, 0.5, 20_000), rng.uniform(0.5, 3, 20_000)
    fast, plain = (scene.intersect(origins, directions, t_min, t_max) for scene in scenes)
    assert 0.01 < plain.is_hit.mean() < 0.99
    for name, values in vars(plain).items():
        np.testing.assert_array_equal(getattr(fast, name), values, name)
    blocked = [scene.occluded(origins, directions, t_min, t_max) for scene in scenes]
    np.testing.assert_array_equal(*blocked)
    np.testing.assert_array_equal(blocked[0], plain.is_hit)
    ends = np.where(plain.is_hit, plain.distance, t_max)  # of rays that end where they hit something
    np.testing.assert_array_equal(*(scene.occluded(origins, directions, t_min, ends) for scene in scenes))


@pytest.mark.parametrize("name", ["moller_trumbore", "watertight"])
def test_each_triangle_test_has_its_blocks_in_world_space(name, rng):
    transforms = np.tile(np.eye(4), (5, 1, 1))
    transforms[:, :3] = rng.normal(size=(5, 3, 4))
    mesh = group([Instances(Mesh(*soup(rng, 500)), transforms)])
    shared = tt.scene_from_mesh(mesh, instances="shared", triangle_test=name)
    assert shared.ray_intersector.blocks.has_test
    copied = tt.scene_from_mesh(mesh, instances="copied", triangle_test=name, fast=False, intersector="brute_force")
    origins, directions = rng.uniform(-3, 3, (5_000, 3)), rng.normal(size=(5_000, 3))
    found, expected = (scene.intersect(origins, directions) for scene in (shared, copied))
    differ = found.triangle_id != expected.triangle_id  # corners of copies are rounded once more seldom
    assert differ.mean() < 1e-3


def test_light_is_taken_pixel_by_pixel():
    transforms = np.tile(np.eye(4), (2, 1, 1))
    transforms[1, 2, 3] = 1
    scene = tt.scene_from_mesh(
        group([Instances(Mesh(*SQUARE), transforms)]), instances="shared", environment=np.ones((2, 4, 3))
    )
    renderer = tt.A2Renderer(scene_data=scene, width=32, height=32)
    renderer.use("brdf").render(spp=64)
    assert "objects in several places" in "\n".join(renderer.receipt())
    assert renderer.image().max() > 0.1
