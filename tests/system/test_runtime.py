"""How Taichi is started: once, as asked, on what is there, and never under the feet of an earlier scene."""

import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import taichi as ti
from support import start

import taichi_tracer as tt
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.runtime import Settings, VulkanDevice

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
    monkeypatch.setattr(runtime.trial, "problem_of", lambda arch, driver: None)  # each of them renders well
    return there


def python(program: str) -> subprocess.CompletedProcess:
    """A program in a process of its own, where Taichi has not been started."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", program]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)


def told(program: str) -> str:
    """What a program prints; it must succeed."""
    result = python(program)
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def test_an_exit_is_silent():
    result = python(f"{MADE}\nrenderer.use('hit').render()")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_the_settings_that_kernels_need_are_given_to_a_start_by_the_user():
    ti.init(arch=ti.cpu, log_level=ti.ERROR)
    assert ti.lang.impl.get_runtime().prog.config().advanced_optimization
    runtime.ensure()
    config = ti.lang.impl.get_runtime().prog.config()
    assert (config.advanced_optimization, config.cfg_optimization) == (False, False)


def test_a_start_in_f64_where_there_is_none_is_told(monkeypatch):
    monkeypatch.setattr(runtime, "running_settings", lambda: Settings("vulkan", "f64", False))
    with pytest.raises(tt.InputError, match=r"vulkan, which has no f64: start it by ti.init\(arch=ti.vulkan"):
        runtime.ensure()


# ── the second start


def test_the_same_settings_again_do_nothing():
    first = ti.lang.impl.get_runtime().prog
    assert tt.init("cpu") == tt.init("auto") == tt.init("cpu", "f32", False) == Settings("cpu", "f32", False)
    assert ti.lang.impl.get_runtime().prog is first


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
    before = memory.Lifetime()
    tt.init("cpu", force=True)
    assert before.is_over()
    assert not memory.Lifetime().is_over()


def test_the_same_call_again_does_nothing_after_a_fallback(devices):
    first = tt.init("cuda", force=True)
    assert tt.init("cuda") == first


@pytest.mark.parametrize("other", [{"threads": 1}, {"debug": True}])
def test_other_threads_or_checks_are_refused(other):
    tt.init("cpu", force=True)
    with pytest.raises(RuntimeError, match="already runs"):
        tt.init("cpu", **other)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("gpu",), "unknown arch 'gpu': .*known are auto, cpu, cuda, metal, vulkan"),
        (("vulcan",), "did you mean 'vulkan'"),
        (("cpu", "f16"), "unknown precision 'f16'.*f32, f64"),
        ((None,), "unknown arch None"),
        (("metal", "f64"), "'f64' does not exist on arch 'metal': use one of cpu, cuda"),
        (("vulkan", "f64"), "'f64' does not exist on arch 'vulkan'"),
    ],
)
def test_settings_that_do_not_exist_are_told(arguments, message):
    first = ti.lang.impl.get_runtime().prog
    with pytest.raises(tt.InputError, match=message):
        tt.init(*arguments, force=True)
    assert ti.lang.impl.get_runtime().prog is first


# ── scenes of an earlier start


def test_auto_leaves_out_a_gpu_that_renders_another_picture(devices, monkeypatch):
    devices.add("vulkan")
    monkeypatch.setattr(runtime.trial, "problem_of", lambda arch, driver: "exit code -11")
    told = "running on the CPU; vulkan does not render as the CPU does (exit code -11)"
    assert runtime._choose("auto", "f32") == ("cpu", told)
    assert runtime._choose("vulkan", "f32") == ("vulkan", None)


def test_asking_for_devices_harms_nothing():
    first = ti.lang.impl.get_runtime().prog
    assert {runtime.has_device(arch) for arch in ("cuda", "metal", "vulkan")} <= {True, False}
    assert ti.lang.impl.get_runtime().prog is first


@pytest.mark.parametrize(
    ("found", "chosen", "said"),
    [([], "cpu", "no device"), ([VulkanDevice("llvmpipe", True)], "vulkan", "in software, which is slower")],
)
def test_vulkan_in_software_is_started_by_its_name(found, chosen, said, devices, monkeypatch):
    monkeypatch.setattr(runtime, "vulkan_devices", lambda: found)
    arch, message = runtime._choose("vulkan", "f32")
    assert arch == chosen
    assert said in message
    assert runtime._choose("auto", "f32")[0] == "cpu"


def test_software_vulkan_is_no_device(monkeypatch):
    monkeypatch.setattr(ti._lib.core, "with_vulkan", lambda: True)
    monkeypatch.setattr(runtime, "LINUX_GPUS", ("/",))
    software, card = VulkanDevice("llvmpipe", True), VulkanDevice("card", False)
    for found, expected in [([], False), ([software], False), ([software, card], True)]:
        monkeypatch.setattr(runtime, "vulkan_devices", lambda found=found: found)
        assert runtime.has_device("vulkan") is expected


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux shows GPUs as files")
def test_without_a_gpu_no_driver_is_loaded(monkeypatch):
    monkeypatch.setattr(runtime, "LINUX_GPUS", ("/dev/there-is-no-such-gpu",))
    monkeypatch.setattr(runtime, "vulkan_devices", lambda: pytest.fail("drivers were loaded"))
    assert not runtime.has_device("vulkan")


@pytest.mark.parametrize("library", [None, "libthere-is-no-such-library.so"])
def test_without_a_vulkan_loader_there_are_no_devices(library, monkeypatch):
    monkeypatch.setattr(runtime, "vulkan_loader", lambda: library)
    assert runtime.vulkan_devices() == []


@pytest.mark.parametrize(("kind", "is_software"), [(1, False), (2, False), (3, False), (4, True)])
def test_a_vulkan_device_is_described_by_its_properties(kind, is_software):
    class Loader:
        def vkGetPhysicalDeviceProperties(self, handle, properties):
            struct.pack_into("<5I256s", properties, 0, 1, 2, 3, 4, kind, "Größe".encode())

    assert runtime._describe(Loader(), 1) == VulkanDevice("Größe", is_software)


# ── what kernels compute in


def test_the_precision_is_that_of_the_kernels(precision):
    start(precision)
    x = ti.field(float, ())
    x[None] = 1 / 3
    assert x[None] == runtime.dtype()(1 / 3)
    assert runtime.dtype() is {"f32": np.float32, "f64": np.float64}[precision]
    assert runtime.epsilon() == {"f32": 2.0**-23, "f64": 2.0**-52}[precision]
    assert runtime.has_f64()
    assert runtime.can_widen() == (precision == "f32")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_process_says_spawn_instead_of_hanging():
    program = f"""{MADE}
import os, signal, sys
renderer.render()
uses = [renderer.render, renderer.image, lambda: renderer.canvas, lambda: tt.init("cpu", force=True)]
uses += [lambda: tt.scene_from_mesh({TRIANGLE}), lambda: scene.intersect([0, 0, 1], [0, 0, -1])]
uses += [lambda: renderer.camera.set_camera_parameters(fov=30)]
child = os.fork()
if child == 0:
    signal.alarm(60)
    told = 0
    for use in uses:
        try:
            use()
        except RuntimeError as error:
            told += "spawn" in str(error)
    scene.destroy()
    sys.exit(told)
_, status = os.waitpid(child, 0)
print(len(uses), os.waitstatus_to_exitcode(status), renderer.render().samples)
"""
    assert told(program) == "7 7 2"
