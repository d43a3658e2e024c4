"""A binary tree of boxes by the surface-area heuristic (Wald, "On fast construction of SAH-based BVHs", RT 2007).

The tree has two levels, as in HLBVH (Pantaleoni & Luebke 2010). The triangles are grouped by the cells of a coarse
grid. One kernel builds a tree for each group, in parallel, and then a tree over the groups.

For a small mesh, numpy is done before a new process has this kernel ready, see ``build_small``.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.view import box_of
from taichi_tracer.intersectors.lanes import larger, smaller
from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time

BLOCK_BITS = 2
BLOCK = 1 << BLOCK_BITS  # a ray tests so many triangles of a leaf together; the kernel splits them no further
NUM_BINS = 16  # per axis; the planes between them are the candidates for a split
FEWEST_BINS = 4  # of a range with few items, for which the bins would take more time than the items
BIN_SCALE = 1 - 1e-6  # reduces the number of bins: rounding then cannot move the largest centre behind the last bin
MAX_LEAF = 8  # the largest number of triangles in a leaf; the heuristic usually makes smaller leaves
COST_OF_BOX = 1.2  # the cost of visiting a node of a small tree, in units of the cost of one triangle test
# Up to this number of triangles, numpy tries every plane, in 13 ms for a thousand of them. The kernel takes 1 ms, but a
# new process needs 45 ms to load it, and 0.15 s to translate it for the first time.
FEW_PRIMITIVES = 3072
TINY = 256  # up to this number of triangles, numpy splits blocks too: rays gain up to 5 %, and the start loses 4 ms
MEDIUM = 8192  # up to this number of triangles, one task of the kernel builds the whole tree, in 4 ms
MOST_BITS = 5  # of a grid cell along an axis: three axes need 15 bits, and numpy sorts 16-bit codes fast, by radix sort
# Nodes that wait on the stack of one task. The larger half always waits, so that 33 entries suffice for 2^32 items.
STACK_SIZE = 64


@dataclass
class BinaryTree:
    """A binary tree over boxes, as arrays. The nodes are numbered level by level: node 0 is the root.

    Attributes:
        levels: (L + 1,) the first node of each of the L levels, and the number of all nodes.
        box: (N, 6) low and high corner of every node.
        child: (N,) the left child, which is followed by the right one; −1 in a leaf.
        begin, end: (N,) the range of ``order`` below a node. Nodes above the groups have a range without meaning, which
            is longer than any leaf.
        order: (F,) ids of the items; the items of a leaf are neighbours.
    """

    levels: np.ndarray
    box: np.ndarray
    child: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    order: np.ndarray


def build(box: np.ndarray, at_once: int = BLOCK) -> BinaryTree:
    """The tree over (F, 6) boxes. Without any, its root is a leaf with a box that no ray meets.

    Args:
        at_once: how many items a ray tests at the cost of one. A tree of more than ``FEW_PRIMITIVES`` items is split
            where the parts need the fewest such tests. Thus the leaves of triangles, tested in blocks, are full more
            often, and their memory is a seventh smaller.
    """
    n = len(box)
    if n <= FEW_PRIMITIVES or not runtime.can("parallel building"):
        return build_small(box)
    order, starts = np.arange(n, dtype=np.int32), np.zeros(1, np.int32)
    if n > MEDIUM:
        order, starts = grid_groups(box)
    ranges = np.stack([starts, np.append(starts[1:], n)], axis=1).astype(np.int32)
    nodes = Nodes(2 * n, box.dtype)
    nodes.split(ranges, box, order, at_once, BLOCK)
    roots = nodes.pack(0)[2 * starts]
    return nodes.tree(order, nodes.join(roots, n))


def build_small(box: np.ndarray) -> BinaryTree:
    """The tree over a few boxes; every plane between two neighbouring centres is a candidate for a split."""
    n = len(box)
    most = 1 if n <= TINY else BLOCK
    order, nodes, stack = np.arange(n, dtype=np.int32), Nodes(max(1, 2 * n), box.dtype), [(0, 0, n)]
    with np.errstate(over="ignore", invalid="ignore"):
        while stack:
            node, begin, end = stack.pop()
            own = box[order[begin:end]]
            nodes.box[node, :3] = own[:, :3].min(axis=0, initial=np.inf)
            nodes.box[node, 3:] = own[:, 3:].max(axis=0, initial=-np.inf)
            nodes.links[node, 1:] = begin, end
            if end - begin <= most:
                continue
            split, count = split_small(own.astype(np.float64))
            if count > 0:
                order[begin:end] = order[begin:end][split]
                left = 2 * (begin + count)
                nodes.links[node, 0] = left
                stack += [(left, begin, begin + count), (left + 1, begin + count, end)]
    return nodes.tree(order, 0)


def split_small(box: np.ndarray) -> tuple[np.ndarray, int]:
    """The order of (k, 6) boxes, k ≥ 2, in which the first ``count`` go to the left, and ``count``; 0 in a leaf."""
    k = len(box)
    orders = np.argsort(box[:, :3] / 2 + box[:, 3:] / 2, axis=0, kind="stable").T  # one for each axis
    area = np.zeros((2, 3, k - 1))  # [left or right of a plane, axis, plane]
    for side, sorted_boxes in enumerate((box[orders], box[orders[:, ::-1]])):
        low = np.minimum.accumulate(sorted_boxes[..., :3], axis=1)
        size = np.maximum.accumulate(sorted_boxes[..., 3:], axis=1) - low
        x, y, z = size[..., 0], size[..., 1], size[..., 2]
        half_areas = x * z + y * x + z * y
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


class Nodes:
    """Boxes and links (child, begin, end) of the nodes while the tree is built. Where no node is, the links are −1."""

    def __init__(self, count: int, dtype: np.dtype) -> None:
        self.box = np.zeros((count, 6), dtype)
        self.links = np.full((count, 3), -1, np.int32)

    def split(self, ranges: np.ndarray, box: np.ndarray, order: np.ndarray, at_once: int, most: int) -> None:
        """Build a tree for each of the (k, 2) ranges of ``order``, see ``_build_ranges``."""
        scratch = [np.empty((len(ranges), *shape), box.dtype) for shape in ((3 * NUM_BINS, 2, 3), (3 * NUM_BINS,))]
        scratch += [np.empty((len(ranges), NUM_BINS), box.dtype), np.empty((len(ranges), STACK_SIZE), np.int32)]
        boxes, node_box = (np.ascontiguousarray(own).reshape(-1, 2, 3) for own in (box, self.box))
        _build_ranges(ranges, at_once, most, boxes, order, node_box, self.links, *scratch)

    def pack(self, first: int) -> np.ndarray:
        """Number the nodes from ``first`` on, without gaps: a third of the memory. (N,) the new number of each."""
        is_node = self.links[:, 1] >= 0
        numbers = np.cumsum(is_node, dtype=np.int32) + np.int32(first - 1)
        self.links, self.box = self.links[is_node], self.box[is_node]
        is_inner = self.links[:, 0] >= 0
        self.links[is_inner, 0] = numbers[self.links[is_inner, 0]]
        return numbers

    def join(self, roots: np.ndarray, n: int) -> int:
        """Build the tree over the roots of the groups of n items, and add it to these nodes; returns its root."""
        if len(roots) == 1:
            return int(roots[0])
        count, order, root = len(roots), np.arange(len(roots), dtype=np.int32), len(self.box)
        top = Nodes(2 * count, self.box.dtype)
        top.split(np.array([[0, count]], np.int32), self.box[roots], order, 1, 1)
        top.pack(root)
        # A leaf over one group becomes the root of this group. An inner node gets the range of all items.
        is_leaf = top.links[:, 0] < 0
        top.links[~is_leaf, 1:] = 0, n
        top.links[is_leaf] = self.links[roots[order[top.links[is_leaf, 1]]]]
        self.links, self.box = np.concatenate([self.links, top.links]), np.concatenate([self.box, top.box])
        return root

    def tree(self, order: np.ndarray, root: int) -> BinaryTree:
        """The tree below a node over the items of ``order``."""
        levels, level = [], np.array([root])
        while len(level) > 0:
            levels.append(level)
            left = self.links[level, 0]
            left = left[left >= 0]
            level = np.stack([left, left + 1], axis=1).reshape(-1)
        nodes = np.concatenate(levels)
        is_inner = self.links[nodes, 0] >= 0
        child = np.where(is_inner, 2 * np.cumsum(is_inner, dtype=np.int32) - 1, np.int32(-1))
        firsts = np.cumsum([0, *map(len, levels)])
        return BinaryTree(firsts, self.box[nodes], child, self.links[nodes, 1], self.links[nodes, 2], order)


def grid_groups(box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Items sorted by the Morton code of their grid cell: (F,) int32 order and (G,) int32 start of every group.

    A surface meets about four times as many cells if there are twice as many along an axis. The number of cells follows
    from this: the groups of a surface have about the same size for any F ≥ 1024. Small groups would have many leaves
    that are not full.
    """
    centre = box[:, :3] + box[:, 3:]
    low, high = box_of(centre)
    size = np.where(high > low, high - low, 1)
    bits = min((len(box).bit_length() - 1) // 2 - 4, MOST_BITS)
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


@ti.kernel
def _build_ranges(
    ranges: ti.types.ndarray(dtype=ti.i32, ndim=2),
    at_once: ti.i32,
    most: ti.i32,
    box: ti.types.ndarray(dtype=tm.vec3, ndim=2),
    order: ti.types.ndarray(dtype=ti.i32, ndim=1),
    node_box: ti.types.ndarray(dtype=tm.vec3, ndim=2),
    links: ti.types.ndarray(dtype=ti.i32, ndim=2),
    bins: ti.types.ndarray(dtype=tm.vec3, ndim=3),
    counts: ti.types.ndarray(ndim=2),
    costs: ti.types.ndarray(ndim=2),
    stack: ti.types.ndarray(dtype=ti.i32, ndim=2),
):
    """One tree for each range [begin, end) of ``order``, with its root at node 2·begin.

    At most one split happens at each position m of ``order``. Its children are the nodes 2m and 2m + 1, so that the
    tasks need no shared counter. A range of up to ``most`` items stays together.
    """
    for task in range(ranges.shape[0]):
        items = _items(task, box, order, bins, counts, costs)
        root = 2 * ranges[task, 0]
        links[root, 1], links[root, 2] = ranges[task, 0], ranges[task, 1]
        stack[task, 0] = root
        waiting = 1
        while waiting > 0:
            waiting -= 1
            node = stack[task, waiting]
            begin, end = links[node, 1], links[node, 2]
            low, high, c_low, c_high = items.bound(begin, end)
            node_box[node, 0], node_box[node, 1] = low, high
            if end - begin > most:
                middle = items.split(begin, end, c_low, c_high, at_once)
                left = 2 * middle
                links[node, 0] = left
                links[left, 1], links[left, 2] = begin, middle
                links[left + 1, 1], links[left + 1, 2] = middle, end
                smaller_is_left = middle - begin <= end - middle
                stack[task, waiting] = ti.select(smaller_is_left, left + 1, left)
                stack[task, waiting + 1] = ti.select(smaller_is_left, left, left + 1)
                waiting += 2


@compile_time
def _items(*arguments):
    return _Items(*arguments)


class _Items:
    """The items of a task, and its memory, within the kernel.

    Args:
        box: low and high corner of every item. order: the ids of the items.
        bins, counts: of each task, for bin j of an axis, the box and the number of the items, at 3 j + axis.
        costs: of each task, area · tests right of the bin before each bin.
    """

    _data_oriented = True  # allows kernels to keep it in a variable

    def __init__(self, task, box, order, bins, counts, costs) -> None:
        self.task, self.box, self.order, self.bins, self.counts, self.costs = task, box, order, bins, counts, costs

    @ti.func
    def corners(self, i):
        """Low and high corner of the item at a position of ``order``."""
        return self.box[self.order[i], 0], self.box[self.order[i], 1]

    @ti.func
    def bound(self, begin, end):
        """The box of a range of items, and the box of their centres; all centres are multiplied by 2."""
        low, high = tm.vec3(tm.inf), tm.vec3(-tm.inf)
        c_low, c_high = tm.vec3(tm.inf), tm.vec3(-tm.inf)
        for i in range(begin, end):
            a, b = self.corners(i)
            low, high = smaller(low, a), larger(high, b)
            c_low, c_high = smaller(c_low, a + b), larger(c_high, a + b)
        return low, high, c_low, c_high

    @ti.func
    def split(self, begin, end, c_low, c_high, at_once):
        """Reorder a range so that it splits into [begin, middle) and [middle, end); returns ``middle``."""
        num_bins = tm.clamp(end - begin, FEWEST_BINS, NUM_BINS)
        scale = num_bins * BIN_SCALE / (c_high - c_low)  # bins per unit
        scale = ti.select((c_high > c_low) & (scale < tm.inf), scale, 0)
        self.fill_bins(begin, end, c_low, scale, num_bins)

        best_cost, best_axis, best_bin = tm.inf, -1, -1
        for axis in range(3):
            cost, last = self.cheapest_plane(axis, num_bins, at_once)
            if cost < best_cost:
                best_cost, best_axis, best_bin = cost, axis, last

        middle = (begin + end) // 2  # if all centres are equal, or if the areas overflow
        if best_axis >= 0:
            i, j = begin, end - 1
            while i <= j:  # the items of the bins up to ``best_bin`` move to the front
                where = self.bins_of(i, c_low, scale, num_bins)
                if ti.select(best_axis == 0, where.x, ti.select(best_axis == 1, where.y, where.z)) <= best_bin:
                    i += 1
                else:
                    self.order[i], self.order[j] = self.order[j], self.order[i]
                    j -= 1
            if begin < i and i < end:  # with fast_math, an infinite cost may be compared wrongly
                middle = i
        return middle

    @ti.func
    def bins_of(self, i, c_low, scale, num_bins):
        """The bin of an item along each axis."""
        a, b = self.corners(i)
        return tm.clamp(ti.cast((a + b - c_low) * scale, ti.i32), 0, num_bins - 1)

    @ti.func
    def fill_bins(self, begin, end, c_low, scale, num_bins):
        """Compute the box and the number of the items in every bin of every axis."""
        for j in range(3 * num_bins):
            self.bins[self.task, j, 0], self.bins[self.task, j, 1] = tm.vec3(tm.inf), tm.vec3(-tm.inf)
            self.counts[self.task, j] = 0
        for i in range(begin, end):
            a, b = self.corners(i)
            where = self.bins_of(i, c_low, scale, num_bins)
            for axis in ti.static(range(3)):
                j = 3 * where[axis] + axis
                self.bins[self.task, j, 0] = smaller(self.bins[self.task, j, 0], a)
                self.bins[self.task, j, 1] = larger(self.bins[self.task, j, 1], b)
                self.counts[self.task, j] += 1

    @ti.func
    def cheapest_plane(self, axis, num_bins, at_once):
        """The minimum of area(left)·tests(left) + area(right)·tests(right) over the planes, and its last left bin."""
        best, best_bin = tm.inf, -1
        low, high, count = tm.vec3(tm.inf), tm.vec3(-tm.inf), 0.0
        for step in range(2 * num_bins - 2):  # first from the last bin to the second one, then from the first one on
            is_back = step < num_bins - 1
            if step == num_bins - 1:
                low, high, count = tm.vec3(tm.inf), tm.vec3(-tm.inf), 0.0
            j = ti.select(is_back, num_bins - 1 - step, step - num_bins + 1)
            low = smaller(low, self.bins[self.task, 3 * j + axis, 0])
            high = larger(high, self.bins[self.task, 3 * j + axis, 1])
            count += self.counts[self.task, 3 * j + axis]
            size, cost = high - low, tm.inf
            if count > 0:
                cost = (size.x * size.y + size.y * size.z + size.z * size.x) * ti.ceil(count / at_once)
            if is_back:
                self.costs[self.task, j] = cost
            elif cost + self.costs[self.task, j + 1] < best:
                best, best_bin = cost + self.costs[self.task, j + 1], j
        return best, best_bin
