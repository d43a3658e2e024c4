"""A binary tree of boxes by the surface-area heuristic (Wald, "On fast construction of SAH-based BVHs", RT 2007).

The tree has two levels, as in HLBVH (Pantaleoni & Luebke 2010). The triangles are grouped by the cells of a coarse
grid. One kernel builds a tree for each group, in parallel, and then a tree over the groups.

Meshes of fewer triangles are done in numpy before this kernel is even compiled; see ``build_small`` and ``bvh_levels``.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.bvh_levels import BIN_SCALE, BLOCK, FEWEST_BINS, NUM_BINS, build_levels
from taichi_tracer.fast.lanes import larger, smaller

MAX_LEAF = 8  # the largest number of triangles in a leaf; the heuristic usually makes smaller leaves
COST_OF_BOX = 1.2  # the cost of visiting a node of a small tree, in units of the cost of one triangle test
SMALL = 256  # up to this number of triangles, every plane is tried (in 30 ms)
MEDIUM = 8192  # up to this number of triangles, numpy is done (in 60 ms) before the kernel is loaded
BATCH = 1 << 18  # triangles between two updates of the progress bar of a long build
SHOW_PROGRESS_AFTER = 2.0  # seconds
MOST_BITS = 5  # of a grid cell along an axis: three axes need 15 bits, and numpy sorts 16-bit codes fast, by radix sort
# Nodes that wait on the stack of one task. The larger half always waits, so that 33 entries suffice for 2^32 items.
STACK_SIZE = 64


@dataclass
class BinaryTree:
    """A binary tree over boxes, as arrays: node 0 is the root.

    Attributes:
        box: (N, 6) low and high corner of every node.
        child: (N,) the left child, which is followed by the right one; −1 in a leaf.
        begin, end: (N,) the range of ``order`` below a node. Nodes above the groups have a range without meaning, which
            is longer than any leaf.
        order: (F,) ids of the items; the items of a leaf are neighbours.
    """

    box: np.ndarray
    child: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    order: np.ndarray


def build(box: np.ndarray, at_once: int = BLOCK) -> BinaryTree:
    """The tree over (F, 6) boxes, F ≥ 1.

    Args:
        at_once: how many items a ray tests at the cost of one. A tree of more than ``SMALL`` items is split where the
            parts need the fewest such tests. Thus the leaves of triangles, tested in blocks, are full more often, and
            their memory is a seventh smaller.
    """
    n = len(box)
    if n <= SMALL:
        return build_small(box)
    if n <= MEDIUM:
        node_box, links, order = build_levels(box, at_once)
        return BinaryTree(node_box, links[:, 0], links[:, 1], links[:, 2], order)
    order, starts = grid_groups(box)
    ends = np.append(starts[1:], n).astype(np.int32)
    nodes = Nodes(2 * n + 2 * len(starts), box.dtype)
    for some in _batches(starts, n):
        scratch = _scratch(len(starts[some]), box.dtype)
        _build_ranges(starts[some], ends[some], 0, at_once, BLOCK, box, order, nodes.box, nodes.links, *scratch)
    if len(starts) == 1:
        return BinaryTree(nodes.box, nodes.links[:, 0], nodes.links[:, 1], nodes.links[:, 2], order)
    return _join(nodes, starts, order)


def build_small(box: np.ndarray) -> BinaryTree:
    """The tree over a few boxes; every plane between two neighbouring centres is a candidate for a split."""
    n = len(box)
    order, nodes, stack = np.arange(n, dtype=np.int32), Nodes(2 * n, box.dtype), [(0, 0, n)]
    while stack:
        node, begin, end = stack.pop()
        own = box[order[begin:end]]
        nodes.box[node] = np.concatenate([own[:, :3].min(axis=0), own[:, 3:].max(axis=0)])
        nodes.links[node, 1:] = begin, end
        split, count = split_small(own.astype(np.float64))
        if count > 0:
            order[begin:end] = order[begin:end][split]
            left = 2 * (begin + count)
            nodes.links[node, 0] = left
            stack += [(left, begin, begin + count), (left + 1, begin + count, end)]
    return BinaryTree(nodes.box, nodes.links[:, 0], nodes.links[:, 1], nodes.links[:, 2], order)


def split_small(box: np.ndarray) -> tuple[np.ndarray, int]:
    """The order of (k, 6) boxes in which the first ``count`` go to the left, and ``count``; it is 0 in a leaf."""
    k = len(box)
    if k == 1:
        return np.zeros(1, np.intp), 0
    orders = np.argsort(box[:, :3] / 2 + box[:, 3:] / 2, axis=0, kind="stable").T  # one for each axis
    area = np.zeros((2, 3, k - 1))  # [left or right of a plane, axis, plane]
    with np.errstate(over="ignore", invalid="ignore"):
        for side, sorted_boxes in enumerate((box[orders], box[orders[:, ::-1]])):
            low = np.minimum.accumulate(sorted_boxes[..., :3], axis=1)
            high = np.maximum.accumulate(sorted_boxes[..., 3:], axis=1)
            size = high - low
            half_areas = (size * np.roll(size, 1, axis=2)).sum(axis=2)
            area[side], whole = half_areas[:, :-1], half_areas[0, -1]
        left = np.arange(1, k)
        cost = area[0] * left + area[1, :, ::-1] * (k - left)
        cost[np.isnan(cost)] = np.inf  # a flat box that is too large: 0 · ∞
        axis, best = divmod(int(np.argmin(cost)), k - 1)
        if k <= MAX_LEAF and not cost[axis, best] + COST_OF_BOX * whole < k * whole:
            return orders[axis], 0
    # If all costs are alike, because the areas overflow or because all boxes are the same, both halves are equal.
    count = best + 1 if cost.min() < cost.max() else k // 2
    return orders[axis], count


def _batches(starts: np.ndarray, n: int) -> Iterator[slice]:
    """Slices of the groups with about ``BATCH`` triangles each. On a terminal, a long build shows a progress bar."""
    if n <= BATCH:
        yield slice(None)
        return
    from tqdm import tqdm

    firsts = np.unique(np.searchsorted(starts, np.arange(0, n, BATCH)))
    options = {"unit": " triangles", "unit_scale": True, "delay": SHOW_PROGRESS_AFTER, "disable": None, "leave": False}
    with tqdm(total=n, desc="building the tree", **options) as bar:
        for first, last in zip(firsts, [*firsts[1:], len(starts)], strict=True):
            yield slice(first, last)
            bar.update((n if last == len(starts) else int(starts[last])) - int(starts[first]))


class Nodes:
    """Boxes and links (child, begin, end) of the nodes while the tree is built."""

    def __init__(self, count: int, dtype: np.dtype) -> None:
        self.box = np.zeros((count, 6), dtype)
        self.links = np.full((count, 3), -1, np.int32)


def _join(nodes: Nodes, starts: np.ndarray, order: np.ndarray) -> BinaryTree:
    """Build the tree over the roots of the groups behind the nodes of the groups, and make its root node 0."""
    n, base = len(order), 2 * len(order)
    roots = 2 * starts
    group_order = np.arange(len(starts), dtype=np.int32)
    group_box = np.ascontiguousarray(nodes.box[roots])
    top = Nodes(2 * len(starts), nodes.box.dtype)
    _build_ranges(
        np.zeros(1, np.int32),
        np.array([len(starts)], np.int32),
        base,
        1,
        1,
        group_box,
        group_order,
        top.box,
        top.links,
        *_scratch(1, nodes.box.dtype),
    )
    # A leaf over one group becomes the root of this group. An inner node gets the range of all triangles.
    is_leaf = (top.links[:, 0] < 0) & (top.links[:, 1] >= 0)
    top.links[~is_leaf, 1:] = 0, n
    top.links[is_leaf] = nodes.links[roots[group_order[top.links[is_leaf, 1]]]]
    nodes.box[base:], nodes.links[base:] = top.box, top.links
    nodes.box[0], nodes.links[0] = top.box[0], top.links[0]
    return BinaryTree(nodes.box, nodes.links[:, 0], nodes.links[:, 1], nodes.links[:, 2], order)


def bits_per_axis(n: int) -> int:
    """log2 of the cells along each axis of the grid for n ≥ 1024 triangles.

    A surface meets about four times as many cells if there are twice as many along an axis. Thus the groups of a
    surface have about the same size for any n: small groups would have many leaves that are not full.
    """
    return min((n.bit_length() - 1) // 2 - 4, MOST_BITS)


def grid_groups(box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Items sorted by the Morton code of their grid cell: (F,) int32 order and (G,) int32 start of every group."""
    centre = box[:, :3] + box[:, 3:]
    low, high = centre.min(axis=0), centre.max(axis=0)
    size = np.where(high > low, high - low, 1)
    bits = bits_per_axis(len(box))
    cells = 1 << bits
    code = np.zeros(len(box), np.uint16)
    for axis in range(3):
        cell = ((centre[:, axis] - low[axis]) * (cells / size[axis])).astype(np.uint16)
        np.minimum(cell, cells - 1, out=cell)
        for bit in range(bits):
            code |= ((cell >> bit) & 1) << (3 * bit + axis)
    order = np.argsort(code, kind="stable").astype(np.int32)
    sorted_code = code[order]
    starts = np.flatnonzero(np.append(True, sorted_code[1:] != sorted_code[:-1])).astype(np.int32)
    return order, starts


def _scratch(tasks: int, dtype: np.dtype) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each task: bins (3 axes × NUM_BINS boxes and counts), area × tests right of every bin, a stack of nodes."""
    bins = np.empty((tasks, 3 * NUM_BINS, 7), dtype)
    areas = np.empty((tasks, NUM_BINS), dtype)
    stack = np.empty((tasks, STACK_SIZE), np.int32)
    return bins, areas, stack


@ti.kernel
def _build_ranges(
    starts: ti.types.ndarray(dtype=ti.i32, ndim=1),
    ends: ti.types.ndarray(dtype=ti.i32, ndim=1),
    base: ti.i32,
    at_once: ti.i32,
    most: ti.i32,
    box: ti.types.ndarray(ndim=2),
    order: ti.types.ndarray(dtype=ti.i32, ndim=1),
    node_box: ti.types.ndarray(ndim=2),
    links: ti.types.ndarray(dtype=ti.i32, ndim=2),
    bins: ti.types.ndarray(ndim=3),
    areas: ti.types.ndarray(ndim=2),
    stack: ti.types.ndarray(dtype=ti.i32, ndim=2),
):
    """One tree for each range [starts, ends) of ``order``, with its root at node 2·start.

    At most one split happens at each position m of ``order``. Its children are the nodes 2m and 2m + 1, so that the
    tasks need no shared counter. A link to a child is ``base`` + the index of the child. A range of up to ``most``
    items stays together.
    """
    for task in range(starts.shape[0]):
        root = 2 * starts[task]
        links[root, 1] = starts[task]
        links[root, 2] = ends[task]
        stack[task, 0] = root
        waiting = 1
        while waiting > 0:
            waiting -= 1
            node = stack[task, waiting]
            begin, end = links[node, 1], links[node, 2]
            low, high, c_low, c_high = bound(box, order, begin, end)
            for k in ti.static(range(3)):
                node_box[node, k] = low[k]
                node_box[node, k + 3] = high[k]
            if end - begin > most:
                middle = split(task, box, order, begin, end, c_low, c_high, at_once, bins, areas)
                left = 2 * middle
                links[node, 0] = base + left
                links[left, 1], links[left, 2] = begin, middle
                links[left + 1, 1], links[left + 1, 2] = middle, end
                smaller_is_left = middle - begin <= end - middle
                stack[task, waiting] = ti.select(smaller_is_left, left + 1, left)
                stack[task, waiting + 1] = ti.select(smaller_is_left, left, left + 1)
                waiting += 2


@ti.func
def corners(box: ti.template(), i):
    """Low and high corner of box i."""
    return tm.vec3(box[i, 0], box[i, 1], box[i, 2]), tm.vec3(box[i, 3], box[i, 4], box[i, 5])


@ti.func
def half_area(low, high):
    """Half the surface area of a box."""
    size = high - low
    return size.x * size.y + size.y * size.z + size.z * size.x


@ti.func
def bound(box: ti.template(), order: ti.template(), begin, end):
    """The box of a range of items, and the box of their centres; all centres are multiplied by 2."""
    low, high = tm.vec3(tm.inf), tm.vec3(-tm.inf)
    c_low, c_high = tm.vec3(tm.inf), tm.vec3(-tm.inf)
    for i in range(begin, end):
        a, b = corners(box, order[i])
        low, high = smaller(low, a), larger(high, b)
        c_low, c_high = smaller(c_low, a + b), larger(c_high, a + b)
    return low, high, c_low, c_high


@ti.func
def bin_of(centre, c_low, bins_per_unit, num_bins):
    """The bin of a centre (multiplied by 2) along each axis."""
    return tm.clamp(ti.cast((centre - c_low) * bins_per_unit, ti.i32), 0, num_bins - 1)


@ti.func
def split(
    task,
    box: ti.template(),
    order: ti.template(),
    begin,
    end,
    c_low,
    c_high,
    at_once,
    bins: ti.template(),
    areas: ti.template(),
):
    """Reorder a range so that it splits into [begin, middle) and [middle, end)."""
    n = end - begin
    num_bins = tm.clamp(n, FEWEST_BINS, NUM_BINS)
    size = c_high - c_low
    bins_per_unit = tm.vec3(0)
    for k in ti.static(range(3)):
        if size[k] > 0:
            bins_per_unit[k] = num_bins * BIN_SCALE / size[k]
            if not bins_per_unit[k] < tm.inf:
                bins_per_unit[k] = 0
    fill_bins(task, box, order, begin, end, c_low, bins_per_unit, num_bins, bins)

    best_cost, best_axis, best_bin = tm.inf, -1, -1
    for axis in range(3):
        cost, last = cheapest_plane(task, axis, num_bins, at_once, bins, areas)
        if cost < best_cost:
            best_cost, best_axis, best_bin = cost, axis, last

    middle = (begin + end) // 2  # if all centres are equal, or if the areas overflow
    if best_axis >= 0:
        middle = partition(box, order, begin, end, best_axis, best_bin, c_low, bins_per_unit, num_bins)
        if middle <= begin or middle >= end:  # with fast_math, an infinite cost may be compared wrongly
            middle = (begin + end) // 2
    return middle


@ti.func
def fill_bins(
    task, box: ti.template(), order: ti.template(), begin, end, c_low, bins_per_unit, num_bins, bins: ti.template()
):
    """Compute the box and the number of the items in every bin of every axis."""
    for axis in range(3):
        for j in range(axis * NUM_BINS, axis * NUM_BINS + num_bins):
            for k in ti.static(range(3)):
                bins[task, j, k] = tm.inf
                bins[task, j, k + 3] = -tm.inf
            bins[task, j, 6] = 0
    for i in range(begin, end):
        a, b = corners(box, order[i])
        where = bin_of(a + b, c_low, bins_per_unit, num_bins)
        for axis in ti.static(range(3)):
            j = axis * NUM_BINS + where[axis]
            for k in ti.static(range(3)):
                bins[task, j, k] = smaller(bins[task, j, k], a[k])
                bins[task, j, k + 3] = larger(bins[task, j, k + 3], b[k])
            bins[task, j, 6] += 1


@ti.func
def bin_corners(bins: ti.template(), task, j):
    """Low and high corner of a bin."""
    low = tm.vec3(bins[task, j, 0], bins[task, j, 1], bins[task, j, 2])
    return low, tm.vec3(bins[task, j, 3], bins[task, j, 4], bins[task, j, 5])


@ti.func
def cheapest_plane(task, axis, num_bins, at_once, bins: ti.template(), areas: ti.template()):
    """The minimum of area(left)·tests(left) + area(right)·tests(right) over the planes, and its last left bin."""
    low, high = tm.vec3(tm.inf), tm.vec3(-tm.inf)
    count = 0.0
    for step in range(num_bins - 1):
        j = num_bins - 1 - step
        a, b = bin_corners(bins, task, axis * NUM_BINS + j)
        low, high = smaller(low, a), larger(high, b)
        count += bins[task, axis * NUM_BINS + j, 6]
        areas[task, j] = tm.inf
        if count > 0:
            areas[task, j] = half_area(low, high) * ti.ceil(count / at_once)
    best, best_bin = tm.inf, -1
    low, high, count = tm.vec3(tm.inf), tm.vec3(-tm.inf), 0.0
    for j in range(num_bins - 1):
        a, b = bin_corners(bins, task, axis * NUM_BINS + j)
        low, high = smaller(low, a), larger(high, b)
        count += bins[task, axis * NUM_BINS + j, 6]
        if count > 0:
            cost = half_area(low, high) * ti.ceil(count / at_once) + areas[task, j + 1]
            if cost < best:
                best, best_bin = cost, j
    return best, best_bin


@ti.func
def partition(box: ti.template(), order: ti.template(), begin, end, axis, last_left, c_low, bins_per_unit, num_bins):
    """Move the items of the bins up to ``last_left`` to the front; returns the position where the others begin."""
    i, j = begin, end - 1
    while i <= j:
        a, b = corners(box, order[i])
        where = bin_of(a + b, c_low, bins_per_unit, num_bins)
        own = ti.select(axis == 0, where.x, ti.select(axis == 1, where.y, where.z))
        if own <= last_left:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i
