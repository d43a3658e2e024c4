"""Every picture and every answer on each backend of this machine, beside those of the CPU."""

import numpy as np
import pytest
from every_picture import SPP, THIRDS, made, pictures

import taichi_tracer as tt
from taichi_tracer.system import runtime

TIES = 0.004  # of the pixels of a view, at most, show another one of two surfaces that are equally near
RELATIVE = 1e-4  # of distances and of coordinates
OF_LIGHT = 1e-3  # of the mean of a picture, from the same random numbers


def backends() -> list[str]:
    """The backends of this machine besides the CPU; Vulkan in software is one."""
    there = [arch for arch in ("cuda", "metal") if runtime.has_device(arch)]
    return [*there, *(["vulkan"] if runtime.vulkan_devices() else [])]


@pytest.mark.long
@pytest.mark.parametrize("arch", backends())
@pytest.mark.parametrize("third", THIRDS)
def test_a_backend_agrees_with_the_cpu(third, arch, tmp_path):
    of_the_cpu = made(tmp_path, "cpu", third)
    found = made(tmp_path, arch, third)
    assert found.keys() == of_the_cpu.keys()
    views = {*tt.A1Renderer.names(), "hits", "distances", "occlusion", "bvh,", "brute_force,"}
    for name, expected in of_the_cpu.items():
        if name.startswith(("seconds", "map")):  # a map counts the nodes of a tree, which is another one
            continue
        if name.split(" ")[0] in views:
            differs = ~np.isclose(found[name], expected, rtol=RELATIVE, atol=RELATIVE)
            assert differs.mean() <= TIES, name
        elif name != "explanation":
            assert found[name].mean() == pytest.approx(expected.mean(), rel=OF_LIGHT), name


def test_every_kind_of_picture_is_tried(f32):
    names = [name for name, _ in pictures(tt)]
    assert len(names) == len(set(names)) > 60
    assert SPP > 1
