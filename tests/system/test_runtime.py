"""How Taichi is started: once, as asked, on what is there, and never under the feet of an earlier scene."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import taichi as ti
from support import start

import taichi_tracer as tt
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.runtime import Settings

ROOT = Path(tt.__file__).parents[1]
TRIANGLE = "[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]"
MADE = f"""
import taichi as ti, taichi_tracer as tt
tt.init("cpu")
scene = tt.scene_from_mesh({TRIANGLE})
renderer = tt.A1Renderer(scene, 8, 8)
"""


@pytest.fixture(autouse=True)
def fresh():
    """Taichi newly started in f32 on the CPU, whatever the test before did to it."""
    start("f32", fast_math=False)


@pytest.fixture(autouse=True, scope="module")
def afterwards():
    """Nothing that these tests do to Taichi is left for the tests of other files."""
    yield
    start("f32", fast_math=False)


@pytest.fixture
def devices(monkeypatch):
    """The backends that have a device, to be chosen by the test."""
    there = set()
    monkeypatch.setattr(runtime, "has_device", there.__contains__)
    return there


def python(program: str) -> subprocess.CompletedProcess:
    """A program in a process of its own, where Taichi has not been started."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", program]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)


def test_an_exit_is_silent():
    result = python(f"{MADE}\nrenderer.use('hit').render()")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_the_settings_that_kernels_need_are_given_to_a_start_by_the_user():
    ti.init(arch=ti.cpu, log_level=ti.ERROR)
    assert ti.lang.impl.get_runtime().prog.config().advanced_optimization
    runtime.ensure()
    config = ti.lang.impl.get_runtime().prog.config()
    assert (config.advanced_optimization, config.cfg_optimization) == (False, False)


# ── the second start


@pytest.mark.parametrize("other", [{"precision": "f64"}, {"fast_math": True}, {"arch": "vulkan"}])
def test_other_settings_are_refused(other, devices):
    devices.add("vulkan")
    first = ti.lang.impl.get_runtime().prog
    with pytest.raises(RuntimeError, match=r"already runs with \(cpu, f32, fast_math=False\).*force=True"):
        tt.init(**{"arch": "cpu"} | other)
    assert ti.lang.impl.get_runtime().prog is first


@pytest.mark.parametrize("other", [{"precision": "f64"}, {"fast_math": True}])
def test_force_starts_again(other):
    wanted = {"arch": "cpu", "precision": "f32", "fast_math": False} | other
    assert tt.init(**wanted, force=True) == Settings(**wanted) == runtime.current()


def test_force_starts_again_even_with_the_same_settings():
    before, _ = memory.filled(np.zeros(1))
    tt.init("cpu", force=True)
    assert before.is_over()
    assert not memory.filled(np.zeros(1))[0].is_over()


# ── scenes of an earlier start


@pytest.mark.parametrize(
    ("found", "chosen", "said"),
    [([], "cpu", "no device"), ([True], "vulkan", "in software, which is slower")],
)
def test_vulkan_in_software_is_started_by_its_name(found, chosen, said, devices, monkeypatch):
    monkeypatch.setattr(runtime, "vulkan_devices", lambda: found)
    arch, message = runtime._choose("vulkan")
    assert arch == chosen
    assert said in message
    assert runtime._choose("auto")[0] == "cpu"


# ── what kernels compute in


def test_the_precision_is_that_of_the_kernels(precision):
    start(precision)
    x = ti.field(float, ())
    x[None] = 1 / 3
    assert x[None] == runtime.dtype()(1 / 3)
    assert runtime.dtype() is {"f32": np.float32, "f64": np.float64}[precision]
    assert runtime.epsilon() == {"f32": 2.0**-23, "f64": 2.0**-52}[precision]
    assert runtime.can("f64")
    assert runtime.can_widen() == (precision == "f32")
