"""The wide tree: the answers of the plain hierarchy, and what it tells of itself."""

import pytest
from shapes import sphere

import taichi_tracer as tt

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


KINDS = ["culled triangles", "spheres", "culled triangles among spheres"]
