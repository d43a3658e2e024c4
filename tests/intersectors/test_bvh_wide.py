"""The wide tree holds what the binary one held, its stack is deep enough, and it costs no more than a simple cut."""

import warnings

import numpy as np
import pytest
from shapes import BOXES

from taichi_tracer.intersectors import bvh_build
from taichi_tracer.intersectors.bvh_wide import LEAF_BITS, WIDTH, collapse, quantise

pytestmark = pytest.mark.usefixtures("f32")


def leaf_range(reference):
    return (-1 - reference) >> LEAF_BITS, (-1 - reference) & ((1 << LEAF_BITS) - 1)


@pytest.mark.parametrize("name", BOXES)
def test_every_item_is_in_one_leaf_within_its_box(name, rng):
    box = np.ascontiguousarray(BOXES[name](rng), np.float32)
    binary = bvh_build.build(box)
    wide = collapse(binary)
    seen = np.zeros(len(box), int)

    def visit(reference, low, high, depth, waiting):
        if reference < 0:
            first, count = leaf_range(reference)
            items = binary.order[first : first + count]
            seen[items] += 1
            assert (box[items, :3] >= low).all()
            assert (box[items, 3:] <= high).all()
            return depth, waiting
        is_child = wide.planes[reference, 0] <= wide.planes[reference, 3]
        deepest, most = depth, waiting + WIDTH  # absent children wait too, if a ray meets their boxes
        for k in np.flatnonzero(is_child):
            planes = wide.planes[reference, :, k]
            down = visit(wide.children[reference, k], planes[:3], planes[3:], depth + 1, waiting + WIDTH - 1)
            deepest, most = max(deepest, down[0]), max(most, down[1])
        return deepest, most

    depth, waiting = visit(wide.root, np.full(3, -np.inf), np.full(3, np.inf), 0, 0)
    assert (seen == 1).all()
    assert depth <= wide.depth
    assert waiting <= 1 + (WIDTH - 1) * wide.depth


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    "name", ["ordinary", "flat", "flat and away", "one point", "far away", "huge", "tiny", "of all sizes"]
)
def test_boxes_on_a_grid_are_never_smaller_and_hardly_larger(name, dtype, rng):
    low = rng.uniform(-1, 1, (200, 3, WIDTH))
    high = low + rng.uniform(0, 1, (200, 3, WIDTH)) ** 4
    if name == "flat":
        low[:, 1] = high[:, 1] = 0.3
    elif name == "flat and away":
        low[:, 1] = high[:, 1] = -7e3
    elif name == "one point":
        low = high = np.full((200, 3, WIDTH), 0.1)
    elif name == "far away":
        low, high = low + 1e5, high + 1e5
    elif name in ("huge", "tiny"):
        exponent = {"huge": np.finfo(dtype).maxexp - 4, "tiny": np.finfo(dtype).minexp + 4}[name]
        low, high = np.ldexp(low, exponent), np.ldexp(high, exponent)
    elif name == "of all sizes":
        scale = 10.0 ** rng.uniform(-12, 12, (200, 1, 1))
        low, high = low * scale, low * scale + (high - low)
    planes = np.concatenate([low, high], axis=1).astype(dtype)
    absent = rng.uniform(size=(200, WIDTH)) < 0.3
    absent[:, 0] = False
    for plane in range(6):
        planes[:, plane][absent] = np.inf if plane < 3 else -np.inf

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        corner, step, numbers = quantise(planes)
    corner, step, numbers = corner[:, :, None], step[:, :, None], numbers.astype(dtype)
    first, last = corner + numbers[:, :3] * step, corner + numbers[:, 3:] * step
    is_present = np.broadcast_to(~absent[:, None], first.shape)
    assert (first <= planes[:, :3])[is_present].all()
    assert (last >= planes[:, 3:])[is_present].all()
    assert (numbers[:, :3] > numbers[:, 3:])[~is_present].all()

    rounding = np.finfo(dtype).eps * np.maximum(abs(first), abs(last)) + np.finfo(dtype).tiny
    extent = np.where(is_present, planes[:, 3:] - corner, 0).max(axis=2, keepdims=True)
    assert (step <= extent / 100 + rounding).all()
    assert (planes[:, :3] - first <= 2 * step + 2 * rounding)[is_present].all()
    assert (last - planes[:, 3:] <= 2 * step + 2 * rounding)[is_present].all()
