"""The tree of ``bvh_build`` for a mesh of medium size, by numpy: all nodes of one depth are split together.

The kernel of ``bvh_build`` takes 0.2 s to read and to translate in a new process. For a few thousand triangles, numpy
is done before. It splits as the kernel does, with the same rounding, so that both build the same nodes; only the order
of the items in a leaf is another one, and which of several items with the same centre go to the left.
"""

import numpy as np

NUM_BINS = 16  # per axis; the planes between them are the candidates for a split
FEWEST_BINS = 4  # of a range with few items, for which the bins would take more time than the items
BIN_SCALE = 1 - 1e-6  # reduces the number of bins: rounding then cannot move the largest centre behind the last bin
BLOCK_BITS = 2
BLOCK = 1 << BLOCK_BITS  # a ray tests so many triangles of a leaf together; they are not split any further
MOST_LEVELS = 48  # below so many levels, ranges are halved: boxes of all sizes would make a level for each


def build_levels(box: np.ndarray, at_once: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(2n, 6) boxes of the nodes, their (2n, 3) links (child, begin, end), and the (n,) int32 order of the items.

    A split at the position m of the order makes the nodes 2m and 2m + 1, as in ``bvh_build``.

    Args:
        box: (n, 6) boxes of the items. at_once: how many items a ray tests at the cost of one.
    """
    n = len(box)
    node_box, links = np.zeros((2 * n, 6), box.dtype), np.full((2 * n, 3), -1, np.int32)
    order = np.arange(n, dtype=np.int32)
    node, begin, end = np.array([0]), np.array([0]), np.array([n])
    level = 0
    while len(node) > 0:
        size = end - begin
        starts = np.concatenate([[0], np.cumsum(size)[:-1]])
        owner = np.repeat(np.arange(len(node)), size)
        place = np.arange(len(owner)) - starts[owner] + begin[owner]  # in ``order``, of every item of these nodes
        own = box[order[place]]
        node_box[node, :3] = np.minimum.reduceat(own[:, :3], starts)
        node_box[node, 3:] = np.maximum.reduceat(own[:, 3:], starts)
        links[node, 1], links[node, 2] = begin, end
        is_split = size > BLOCK
        is_right = sides(own, owner, starts, size, at_once)
        left = size - np.add.reduceat(is_right, starts)
        is_even = is_split & ((left == 0) | (left == size) | (level >= MOST_LEVELS))
        left = np.where(is_even, size // 2, left)
        is_right = np.where(is_even[owner], place - begin[owner] >= left[owner], is_right & is_split[owner])
        order[place] = order[place][np.argsort(2 * owner + is_right, kind="stable")]
        middle = (begin + left)[is_split]
        links[node[is_split], 0] = 2 * middle
        node = np.stack([2 * middle, 2 * middle + 1], axis=1).reshape(-1)
        begin = np.stack([begin[is_split], middle], axis=1).reshape(-1)
        end = np.stack([middle, end[is_split]], axis=1).reshape(-1)
        level += 1
    return node_box, links, order


def sides(own: np.ndarray, owner: np.ndarray, starts: np.ndarray, size: np.ndarray, at_once: int) -> np.ndarray:
    """(m,) int, 1 for the items that go to the right child; all 0 for a node without a plane that separates its items.

    Args:
        own: (m, 6) boxes of the items of k nodes, one node after the other.
        owner: (m,) the node of every item. starts: (k,) the first item of every node. size: (k,) how many it has.
        at_once: how many items a ray tests at the cost of one.
    """
    kind = own.dtype.type
    centre = own[:, :3] + own[:, 3:]  # multiplied by 2
    low, high = np.minimum.reduceat(centre, starts), np.maximum.reduceat(centre, starts)
    num_bins = np.clip(size, FEWEST_BINS, NUM_BINS)
    with np.errstate(all="ignore"):
        scale = (num_bins.astype(kind) * kind(BIN_SCALE))[:, None] / (high - low)
        scale[~(np.isfinite(scale) & (high > low))] = 0
        bin_of = ((centre - low[owner]) * scale[owner]).astype(np.int32)
    bin_of = np.clip(bin_of, 0, (num_bins - 1)[owner, None])
    cost = np.stack([costs(own, NUM_BINS * owner + bin_of[:, axis], len(size), at_once) for axis in range(3)], axis=1)
    best = cost.reshape(len(size), -1).argmin(axis=1)  # of the first axis and the first plane, if several are alike
    axis, last = np.divmod(best, NUM_BINS - 1)
    best_cost = cost[np.arange(len(size)), axis, last]
    chosen = bin_of[np.arange(len(owner)), axis[owner]]
    return ((chosen > last[owner]) & np.isfinite(best_cost)[owner]).astype(np.intp)


def costs(own: np.ndarray, key: np.ndarray, count: int, at_once: int) -> np.ndarray:
    """(count, NUM_BINS − 1) area(left) · tests(left) + area(right) · tests(right) for the plane behind each bin.

    Args:
        own: (m, 6) boxes. key: (m,) NUM_BINS · node + bin of every box.
    """
    kind = own.dtype.type
    by_key = np.argsort(key, kind="stable")
    keys, first = np.unique(key[by_key], return_index=True)
    low, high = np.full((count * NUM_BINS, 3), np.inf, kind), np.full((count * NUM_BINS, 3), -np.inf, kind)
    low[keys] = np.minimum.reduceat(own[by_key, :3], first)
    high[keys] = np.maximum.reduceat(own[by_key, 3:], first)
    items = np.bincount(key, minlength=count * NUM_BINS).reshape(count, NUM_BINS)
    low, high = low.reshape(count, NUM_BINS, 3), high.reshape(count, NUM_BINS, 3)
    with np.errstate(all="ignore"):
        left = part(low, high, items, at_once)[:, :-1]
        right = part(low[:, ::-1], high[:, ::-1], items[:, ::-1], at_once)[:, ::-1][:, 1:]
        cost = left + right
    return np.where(np.isnan(cost), kind(np.inf), cost)


def part(low: np.ndarray, high: np.ndarray, items: np.ndarray, at_once: int) -> np.ndarray:
    """(k, b) area · tests of the first 1, 2, … bins; infinite for bins without items."""
    low, high = np.minimum.accumulate(low, axis=1), np.maximum.accumulate(high, axis=1)
    number = np.cumsum(items, axis=1)
    return np.where(number > 0, half_area(low, high) * -(-number // at_once).astype(low.dtype), low.dtype.type(np.inf))


def half_area(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(...) half the surface areas of boxes with (..., 3) corners."""
    size = high - low
    x, y, z = size[..., 0], size[..., 1], size[..., 2]
    return x * y + y * z + z * x
