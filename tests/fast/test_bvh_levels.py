"""The tree that numpy builds level by level has the nodes that the kernel builds."""

import numpy as np
import pytest

from taichi_tracer.fast import bvh_build
from taichi_tracer.fast.bvh_levels import BLOCK, MOST_LEVELS, build_levels
from taichi_tracer.system import runtime


def by_kernel(box, at_once):
    """Boxes of the nodes, their links, and the order, by the kernel of ``bvh_build``."""
    n = len(box)
    starts, ends, order = np.array([0], np.int32), np.array([n], np.int32), np.arange(n, dtype=np.int32)
    nodes, scratch = bvh_build.Nodes(2 * n, box.dtype), bvh_build._scratch(1, box.dtype)
    bvh_build._build_ranges(starts, ends, 0, at_once, BLOCK, box, order, nodes.box, nodes.links, *scratch)
    return nodes.box, nodes.links, order


def boxes(name, rng):
    """(n, 6) boxes of one kind, in the running precision."""
    if name == "alike":
        low, size = np.zeros((300, 3)), np.ones((300, 3))
    elif name == "of all sizes":  # five of each
        low = np.repeat(2.0 ** -np.arange(60)[:, None] * np.ones(3), 5, axis=0)
        size = low / 10
    elif name == "in a plane":
        low, size = rng.random((700, 3)) * [1, 0, 1], np.array([0.02, 0, 0.02])
    elif name == "huge":  # areas overflow
        low, size = 1e25 * rng.random((400, 3)), 1e24
    else:
        low, size = rng.random((3000, 3)) ** (8 if name == "clustered" else 1), 0.05 * rng.random((3000, 3))
    return np.concatenate([low, low + size], axis=1).astype(runtime.dtype())


@pytest.mark.parametrize("at_once", [1, BLOCK])
@pytest.mark.parametrize("name", ["scattered", "clustered", "in a plane", "of all sizes", "alike"])
def test_the_nodes_are_those_of_the_kernel(precision, rng, name, at_once):
    box = boxes(name, rng)
    node_box, links, order = build_levels(box, at_once)
    wanted_box, wanted_links, wanted_order = by_kernel(box, at_once)
    np.testing.assert_array_equal(links, wanted_links)
    is_used = links[:, 1] >= 0
    np.testing.assert_array_equal(node_box[is_used], wanted_box[is_used])
    for child, begin, end in links[is_used]:
        if child < 0:
            ours, theirs = box[order[begin:end]], box[wanted_order[begin:end]]  # items may be alike
            np.testing.assert_array_equal(np.unique(ours, axis=0), np.unique(theirs, axis=0))


@pytest.mark.parametrize("box", [np.zeros((1, 6)), np.zeros((4, 6)), "huge", "without an end"], ids=str)
def test_every_item_is_in_one_leaf(f32, rng, box):
    if isinstance(box, str) and box == "without an end":  # every split takes away one item, to far below the last level
        low = 8.0 ** -np.arange(MOST_LEVELS + 30)[:, None] * np.ones(3)
        box = np.concatenate([low, low], axis=1)
    elif isinstance(box, str):
        box = boxes(box, rng)
    _, links, order = build_levels(np.asarray(box, np.float64), BLOCK)
    leaves = [range(begin, end) for child, begin, end in links if child < 0 <= begin]
    assert sorted(i for leaf in leaves for i in leaf) == list(range(len(box)))
    assert sorted(order) == list(range(len(box)))
    assert max(map(len, leaves)) <= BLOCK
