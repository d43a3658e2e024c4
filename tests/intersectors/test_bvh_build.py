"""Every item is in one leaf, every box holds what is below it: for any boxes."""

import numpy as np
import pytest
from shapes import BOXES, random_boxes

from taichi_tracer.intersectors import bvh_build

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("name", BOXES)
def test_a_small_tree_is_one(name, rng):
    box = np.ascontiguousarray(BOXES[name](rng)[: bvh_build.FEW_PRIMITIVES], np.float32)
    check(box, bvh_build.build(box))


def check(box, tree):
    """Every item is in one leaf, and every box is as large as what is below it."""
    np.testing.assert_array_equal(np.sort(tree.order), np.arange(len(box)))
    seen = np.zeros(len(box), int)
    waiting = [0]
    while waiting:
        node = waiting.pop()
        left = tree.child[node]
        if left < 0:
            assert 0 < tree.end[node] - tree.begin[node] <= bvh_build.MAX_LEAF
            items = box[tree.order[tree.begin[node] : tree.end[node]]]
            seen[tree.order[tree.begin[node] : tree.end[node]]] += 1
        else:
            items = tree.box[[left, left + 1]]
            waiting += [left, left + 1]
        np.testing.assert_array_equal(tree.box[node, :3], items[:, :3].min(axis=0))
        np.testing.assert_array_equal(tree.box[node, 3:], items[:, 3:].max(axis=0))
    assert (seen == 1).all()


def test_the_heuristic_separates_two_clusters(rng):
    """Two far clusters: the root's children are they, whatever their sizes."""
    near, far = random_boxes(rng, 100), random_boxes(rng, 900) + 50
    tree = bvh_build.build(np.concatenate([near, far]).astype(np.float32))
    left = tree.child[0]
    assert {tree.end[left] - tree.begin[left], tree.end[left + 1] - tree.begin[left + 1]} == {100, 900}
