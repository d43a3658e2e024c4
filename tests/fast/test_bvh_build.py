"""Every item is in one leaf, every box holds what is below it: for any boxes."""

import numpy as np
import pytest
from shapes import BOXES, random_boxes

from taichi_tracer.fast import bvh_build

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


def test_grid_groups_are_cells(rng):
    box = random_boxes(rng, 10_000).astype(np.float32)
    order, starts = bvh_build.grid_groups(box)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(box)))
    centre = (box[:, :3] + box[:, 3:])[order]
    cell = 1.01 * np.ptp(centre, axis=0) / 2 ** bvh_build.bits_per_axis(10_000)
    for begin, end in zip(starts, np.append(starts[1:], len(box)), strict=True):
        assert (np.ptp(centre[begin:end], axis=0) <= cell).all()


def test_the_grid_has_the_same_number_of_triangles_in_a_cell_of_a_surface():
    sizes = [bvh_build.MEDIUM, 4 * bvh_build.MEDIUM, 16 * bvh_build.MEDIUM, 1 << 30]
    assert [bvh_build.bits_per_axis(n) for n in sizes] == [2, 3, 4, bvh_build.MOST_BITS]


def test_leaves_are_almost_full(rng):
    """A range is split where the parts need the fewest blocks."""
    low = rng.random((5_000, 3)).astype(np.float32)
    tree = bvh_build.build(np.concatenate([low, low + np.float32(0.01)], axis=1))
    size = (tree.end - tree.begin)[(tree.child < 0) & (tree.begin >= 0)]
    assert size.sum() == 5_000
    assert (size <= bvh_build.BLOCK).all()
    assert size.mean() > 0.85 * bvh_build.BLOCK


def test_the_heuristic_separates_two_clusters(rng):
    """Two far clusters: the root's children are they, whatever their sizes."""
    near, far = random_boxes(rng, 100), random_boxes(rng, 900) + 50
    tree = bvh_build.build(np.concatenate([near, far]).astype(np.float32))
    left = tree.child[0]
    assert {tree.end[left] - tree.begin[left], tree.end[left + 1] - tree.begin[left + 1]} == {100, 900}


@pytest.mark.parametrize("count", [2, 36, bvh_build.TINY, bvh_build.FEW_PRIMITIVES])
def test_a_small_tree_is_as_good_as_the_kernels(count, rng, monkeypatch):
    box = random_boxes(rng, count).astype(np.float32)
    small = expected_cost(bvh_build.build(box))
    monkeypatch.setattr(bvh_build, "FEW_PRIMITIVES", 0)
    assert small <= 1.02 * expected_cost(bvh_build.build(box))


def expected_cost(tree):
    """Of a ray that meets the root, in triangle tests."""
    size = tree.box[:, 3:].astype(float) - tree.box[:, :3]
    area = (size * np.roll(size, 1, axis=1)).sum(axis=1)
    is_leaf, is_inner = (tree.child < 0) & (tree.end > tree.begin), tree.child >= 0
    tests = (area * (tree.end - tree.begin))[is_leaf].sum() + bvh_build.COST_OF_BOX * area[is_inner].sum()
    return tests / area[0]


def test_batches_hold_every_group_once(monkeypatch):
    monkeypatch.setattr(bvh_build, "BATCH", 10)
    starts = np.array([0, 3, 4, 25, 26, 31, 60], np.int32)
    slices = list(bvh_build._batches(starts, 64))
    assert len(slices) > 2
    np.testing.assert_array_equal(np.concatenate([starts[s] for s in slices]), starts)
    assert [len(starts[s]) > 0 for s in slices] == [True] * len(slices)
    assert list(bvh_build._batches(starts[:1], 10)) == [slice(None)]


def test_batches_change_no_bit_of_the_tree(monkeypatch, rng):
    low = rng.random((20_000, 3)).astype(np.float32)
    box = np.concatenate([low, low + np.float32(0.01)], axis=1)
    whole = bvh_build.build(box)
    monkeypatch.setattr(bvh_build, "BATCH", 1_000)
    parts = bvh_build.build(box)
    for name in ("box", "child", "begin", "end", "order"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
