"""A block of its own changes what Taichi has to look through, and no value."""

import os
import subprocess
import sys

import numpy as np
import pytest
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


PICTURE = """
import taichi_tracer as tt
scene = tt.load_scene_data("cube", environment="studio")
tt.{renderer}(scene, 8, 8).use("{name}").render(1)
"""
MOST = 500  # own statements; where no calculation has a block of its own, there are more than 1,000


def own_statements(kernel: list[str]) -> list[int]:
    """The statements in each block that holds half of a kernel, without those that stand in blocks within it."""
    open_blocks, done = [], []  # [indentation, own statements, all statements]
    for line in kernel:
        indent = len(line) - len(line.lstrip())
        while open_blocks and open_blocks[-1][0] > indent:
            done.append(open_blocks.pop())
        if not open_blocks or open_blocks[-1][0] < indent:
            open_blocks.append([indent, 0, 0])
        open_blocks[-1][1] += 1
        for block in open_blocks:
            block[2] += 1
    return [own for _, own, together in done + open_blocks if 2 * together > len(kernel)]


@pytest.mark.parametrize(("renderer", "name"), [("A2Renderer", "brdf"), ("A4Renderer", "path")])
def test_the_outer_blocks_of_a_sample_are_short(renderer, name):
    """Each statement of the kernel lets Taichi look through all of them."""
    prints = {"TI_PRINT_PREPROCESSED_IR": "1", "TI_OFFLINE_CACHE": "0"}
    command = [sys.executable, "-c", PICTURE.format(renderer=renderer, name=name)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ | prints).stdout
    kernels = [part.split("\n}")[0].splitlines()[1:] for part in printed.split("\nkernel {")[1:]]
    largest = max(kernels, key=len)
    assert len(largest) > 3000
    assert 0 < max(own_statements(largest)) < MOST
