"""What the tree tells of itself; that it answers as brute force does is in contracts/test_intersectors.py."""

import numpy as np
import pytest
from shapes import SQUARE, sphere
from support import start

import taichi_tracer as tt


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


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


def test_a_destroyed_tree_leaves_others_alone():
    first, second = (tt.scene_from_mesh(*SQUARE) for _ in range(2))
    first.destroy()
    assert second.intersect([0, 0.1, 1], [0, 0, -1]).is_hit[0]
    np.testing.assert_array_equal(second.occluded([0, 0.1, 1], [0, 0, -1]), [True])
