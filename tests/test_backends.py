"""Every picture and every answer on each backend of this machine, beside those of the CPU; and in debug mode."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from every_picture import SPP, pictures

import taichi_tracer as tt
from taichi_tracer.system import runtime

HERE = Path(__file__).parent
TIES = 0.004  # of the pixels of a view, at most, show another one of two surfaces that are equally near
RELATIVE = 1e-4  # of distances and of coordinates
OF_LIGHT = 1e-3  # of the mean of a picture, from the same random numbers


def made(folder: Path, arch: str, *mode: str) -> dict:
    """All pictures, from a process of its own; it must be silent."""
    file = folder / f"{arch}{''.join(mode)}.npz"
    command = [sys.executable, str(HERE / "every_picture.py"), arch, str(file), *mode]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (HERE.parent, HERE)))}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    told = [line for line in done.stdout.splitlines() if not line.startswith("[Taichi]")]
    assert (done.returncode, told[:20]) == (0, []), done.stderr[-2000:]
    return dict(np.load(file))


def backends() -> list[str]:
    """The backends of this machine besides the CPU; Vulkan in software is one."""
    there = [arch for arch in ("cuda", "metal") if runtime.has_device(arch)]
    return [*there, *(["vulkan"] if runtime.vulkan_devices() else [])]


@pytest.fixture(scope="module")
def of_the_cpu(tmp_path_factory):
    return made(tmp_path_factory.mktemp("cpu"), "cpu")


@pytest.mark.long
@pytest.mark.parametrize("arch", backends())
def test_a_backend_agrees_with_the_cpu(arch, of_the_cpu, tmp_path):
    found = made(tmp_path, arch)
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


@pytest.mark.long
def test_nothing_is_read_outside_and_nothing_overflows(tmp_path):
    """Taichi's debug mode tells both; the pictures are those of the usual mode."""
    made(tmp_path, "cpu", "debug")


def test_every_kind_of_picture_is_tried(f32):
    names = [name for name, _ in pictures(tt)]
    assert len(names) == len(set(names)) > 60
    assert SPP > 1
