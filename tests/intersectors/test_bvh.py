"""The hierarchy that is there to be read: a tree, a stack that is deep enough, and the answers of brute force.

In plain form it is compared, bit for bit, with the plain form of brute force and with the wide tree that stands in for
it.
"""

from shapes import sphere

import taichi_tracer as tt

# ── the answers ──


# ── the intersector ──


def test_facts_are_those_of_the_tree(f32):
    tree = tt.scene_from_mesh(*sphere(12, 7), intersector="bvh").ray_intersector
    assert tree.facts() == {"nodes": f"{tree.num_nodes:,}", "stack": f"{tree.stack_size}"}
    assert tree.num_nodes > 20
    assert tree.stack_size == 64  # the tree is not deep
