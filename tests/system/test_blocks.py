"""A block of its own changes what Taichi has to look through, and no value."""

import numpy as np
import taichi as ti

from taichi_tracer.system.blocks import IN_A_BLOCK


@ti.func
def long_calculation(x):
    for _ in ti.static(range(30)):
        x = ti.sqrt(x * x * 1.25 + 0.1)
    return x


def test_a_block_of_its_own_changes_no_value(f32):
    """Also inside a loop that adds to what was before the block; both kernels compute the same bits."""
    plain, in_a_block = ti.field(float, 64), ti.field(float, 64)

    @ti.kernel
    def fill():
        for i in plain:
            total = 0.0
            for k in range(3):
                total += long_calculation(float(i + k))
            plain[i] = total
        for i in in_a_block:
            total = 0.0
            for k in range(3):
                if IN_A_BLOCK:
                    total += long_calculation(float(i + k))
            in_a_block[i] = total

    fill()
    np.testing.assert_array_equal(plain.to_numpy(), in_a_block.to_numpy())
    assert len(set(plain.to_numpy())) > 3
