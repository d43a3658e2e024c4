"""From a binary tree to a tree whose nodes have eight children, with the smallest expected cost.

Dynamic programming decides for the whole tree, level by level, which descendants become the children of a node (Ylitie,
Karras & Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", HPG 2017, section 3.1).
"""

from dataclasses import dataclass

import numpy as np

from taichi_tracer.intersectors.bvh_build import BLOCK, MAX_LEAF, BinaryTree

WIDTH = 8  # children of a node: one vector instruction of AVX2 tests the boxes of eight
LEAF_BITS = 4  # a reference to a leaf is the number −1 − (first·2^LEAF_BITS + count)
ABSENT = -1  # the reference to an empty leaf, for a child that does not exist
COST_OF_NODE = 1.0  # the cost of testing the eight boxes of a node
COST_OF_BLOCK = 0.7  # the cost of testing the triangles of a block; only the ratio of the two costs matters
SMALLEST_AREA = 1e-300  # replaces the area 0 of a tree that is only a point or a line: no division by 0


LAST_STEP = 255  # the largest number in a byte
MOST_STEPS = 253  # the size of a node in steps, at most; two steps are left for rounding outwards


def quantise(planes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``WideTree.planes``, rounded outwards to the grid of each node (Ylitie, Karras & Laine, section 3.2).

    A plane is at corner + number · step. Steps are powers of two, so that number · step is exact and only the sum is
    rounded. Therefore all forms of the code compute the same plane. Numbers take a quarter of the memory of planes.

    Returns:
        (W, 3) corner and (W, 3) step in the running precision; and (W, 6, 8) uint8 numbers, in the order of the planes.
        The box of an absent child is inside out (low > high).
    """
    dtype = planes.dtype.type
    low, high = planes[:, :3], planes[:, 3:]
    corner = low.min(axis=2)
    wanted = high.max(axis=2).astype(np.float64) / MOST_STEPS - corner.astype(np.float64) / MOST_STEPS
    # A flat node gets steps in which its coordinates can still be counted: planes divided by a step must be finite.
    wanted = np.where(wanted > 0, wanted, np.abs(corner.astype(np.float64)) * (np.finfo(dtype).eps / 2))
    exponent = np.ceil(np.log2(np.maximum(wanted, float(np.finfo(dtype).tiny))))
    step = np.ldexp(1.0, exponent.astype(np.int32)).astype(dtype)

    from_corner, by = corner[:, :, None], step[:, :, None]
    is_absent = low > high
    low, high = np.where(is_absent, from_corner, low), np.where(is_absent, from_corner, high)
    first = np.floor(low / by - from_corner / by)
    last = np.ceil(high / by - from_corner / by)
    with np.errstate(over="ignore"):
        while (inside := from_corner + first * by > low).any():
            first -= inside
        while (inside := from_corner + last * by < high).any():
            last += inside
    numbers = np.concatenate([np.where(is_absent, LAST_STEP, first), np.where(is_absent, 0, last)], axis=1)
    return corner, step, numbers.astype(np.uint8)


@dataclass
class WideTree:
    """Nodes with ``WIDTH`` children. ``root`` refers to node 0; if the tree is a single leaf, it refers to this leaf.

    Attributes:
        planes: (W, 6, 8) low x y z, high x y z of the children's boxes. The box of an absent child is inside out (low >
            high).
        children: (W, 8) int32, each the index of a node, a leaf (see ``leaf_reference``), or ``ABSENT``.
        depth: the number of nodes on the longest path from the root.
        cost: the expected cost of a ray that meets the root's box, in tests of four triangles (the surface-area
            heuristic).
    """

    planes: np.ndarray
    children: np.ndarray
    root: int
    depth: int
    cost: float


def leaf_reference(begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The reference to a leaf over the range [begin, end) of the ordered triangles: a negative number."""
    return -1 - ((begin << LEAF_BITS) + (end - begin))


def collapse(tree: BinaryTree) -> WideTree:
    """The wide tree of the smallest cost that can be made from a binary tree."""
    plan = _Plan(tree)
    if plan.is_leaf[0]:
        nothing, root = np.zeros((1, 6, WIDTH), tree.box.dtype), leaf_reference(tree.begin[0], tree.end[0])
        tests = -(-(tree.end[0] - tree.begin[0]) // BLOCK)
        return WideTree(nothing, np.full((1, WIDTH), ABSENT, np.int32), int(root), 1, float(tests))

    members_of: list[np.ndarray] = []
    children_of: list[np.ndarray] = []
    level, first_of_next = np.array([0]), 1
    while len(level) > 0:
        members = plan.members(level)
        is_inner = (members >= 0) & ~plan.is_leaf[members]
        children = np.where(members >= 0, leaf_reference(tree.begin[members], tree.end[members]), ABSENT)
        children[is_inner] = first_of_next + np.arange(is_inner.sum())
        members_of.append(members)
        children_of.append(children)
        level = members[is_inner]
        first_of_next += len(level)

    members = np.concatenate(members_of)
    boxes = tree.box[members]
    boxes[members < 0] = [np.inf] * 3 + [-np.inf] * 3
    return WideTree(
        planes=np.ascontiguousarray(boxes.transpose(0, 2, 1)),
        children=np.concatenate(children_of).astype(np.int32),
        root=0,
        depth=len(members_of),
        cost=float(plan.cost / max(plan.area, SMALLEST_AREA) / COST_OF_BLOCK),
    )


class _Plan:
    """The cheapest choice for every binary node: to become a leaf, a wide node, or to give its slots to its children.

    The left children of a level are every other node of the next level, and the right children are the nodes between
    them.

    Attributes:
        slots: (N, 9) how many of i slots of the wide node above it the cheapest choice uses.
        to_left: (N, 9) how many of these slots go to the left child.
        is_leaf: (N,) whether a node that takes one slot becomes a leaf.
        cost, area: the cost of the whole tree, and half the surface area of its box.
    """

    def __init__(self, tree: BinaryTree) -> None:
        self.tree, n = tree, len(tree.box)
        self.slots = np.ones((n, WIDTH + 1), np.int8)
        self.to_left = np.zeros((n, WIDTH + 1), np.int8)
        self.is_leaf = np.ones(n, bool)
        cost = np.zeros((WIDTH + 1, 0), np.float32)
        for first, last in zip(tree.levels[-2::-1], tree.levels[:0:-1], strict=True):
            cost, area = self._decide(slice(first, last), cost)
        self.cost, self.area = float(cost[1, 0]), float(area[0])

    def _decide(self, level: slice, below: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """C(n, i) of the paper: (9, m) the cost of each node of a level, if it may take up to i slots; and its area.

        Args:
            level: the numbers of the nodes. below: the costs of the level below.
        """
        box, is_inner = self.tree.box[level], self.tree.child[level] >= 0
        size = (box[:, 3:] - box[:, :3]).astype(np.float64)
        area = size[:, 0] * size[:, 1] + size[:, 1] * size[:, 2] + size[:, 2] * size[:, 0]
        count = self.tree.end[level] - self.tree.begin[level]
        with np.errstate(invalid="ignore"):  # the box of a leaf without items is inside out, and infinite
            as_leaf = np.where(count <= MAX_LEAF, area * -(-count // BLOCK) * COST_OF_BLOCK, np.inf)
        cost = np.repeat(as_leaf[None].astype(np.float32), WIDTH + 1, axis=0)
        if not is_inner.any():
            return cost, area
        left, right = np.ascontiguousarray(below[:, 0::2]), np.ascontiguousarray(below[:, 1::2])
        shared = np.full((WIDTH + 1, left.shape[1]), np.inf, np.float32)
        to_left = np.zeros((WIDTH + 1, left.shape[1]), np.int8)
        for i in range(2, WIDTH + 1):
            for k in range(1, i):
                option = left[k] + right[i - k]
                is_better = option < shared[i]
                np.copyto(shared[i], option, where=is_better)
                np.copyto(to_left[i], k, where=is_better)
            to_left[i][to_left[i] == 0] = 1  # if all costs are infinite
        inner = np.flatnonzero(is_inner)
        as_node = shared[WIDTH] + area[inner] * COST_OF_NODE
        best = np.minimum(as_leaf[inner], as_node).astype(np.float32)
        slots = np.ones((WIDTH + 1, len(inner)), np.int8)
        costs = np.repeat(best[None], WIDTH + 1, axis=0)
        for i in range(2, WIDTH):
            is_better = shared[i] < costs[i - 1]
            costs[i] = np.where(is_better, shared[i], costs[i - 1])
            slots[i] = np.where(is_better, i, slots[i - 1])
        cost[:, inner] = costs
        inner += level.start
        self.is_leaf[inner] = as_leaf[inner - level.start] <= as_node
        self.slots[inner], self.to_left[inner] = slots.T, to_left.T
        return cost, area

    def members(self, level: np.ndarray) -> np.ndarray:
        """(K, 8) the binary nodes that become the children of K wide nodes; −1 for absent children."""
        rows = np.arange(len(level))
        to_left = self.to_left[level, WIDTH].astype(np.int64)
        owner = np.concatenate([rows, rows])
        left = self.tree.child[level]
        node = np.concatenate([left, left + 1]).astype(np.int64)
        slots = np.concatenate([to_left, WIDTH - to_left])
        done_owner, done_node = [], []
        while len(node) > 0:
            slots = self.slots[node, slots].astype(np.int64)
            is_done = slots == 1
            done_owner.append(owner[is_done])
            done_node.append(node[is_done])
            owner, node, slots = owner[~is_done], node[~is_done], slots[~is_done]
            to_left = self.to_left[node, slots].astype(np.int64)
            owner = np.concatenate([owner, owner])
            slots = np.concatenate([to_left, slots - to_left])
            left = self.tree.child[node]
            node = np.concatenate([left, left + 1]).astype(np.int64)
        owner, node = np.concatenate(done_owner), np.concatenate(done_node)
        order = np.argsort(owner, kind="stable")
        owner, node = owner[order], node[order]
        position = np.arange(len(owner)) - np.searchsorted(owner, owner)
        members = np.full((len(level), WIDTH), -1, np.int64)
        members[owner, position] = node
        return members
