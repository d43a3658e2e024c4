"""Around the reading and the translating of a kernel: what is counted."""

from types import SimpleNamespace

import pytest
import taichi as ti

from taichi_tracer.system import compiling
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.taichi_17 import arguments as kernels


@pytest.fixture(autouse=True)
def nothing_counted(monkeypatch):
    """No kernel is known yet."""
    for name, empty in (("_kernels", []), ("_by_id", {})):
        monkeypatch.setattr(compiling, name, empty)


def test_what_a_gpu_cannot_compile_or_run_is_one_line(monkeypatch):
    def fails(*_words):
        raise RuntimeError("\n[lower_matrix_ptr.cpp:visit@535] not dynamic indexable.\nFile ...")

    launch, config = kernels.launching(fails), SimpleNamespace(arch=ti.vulkan)
    monkeypatch.setattr(kernels.impl, "current_cfg", lambda: config)
    with pytest.raises(InputError, match=r"^vulkan cannot run a kernel .*\(.*not dynamic indexable.\): use the CPU"):
        launch(None)
    config.arch = ti.x64
    with pytest.raises(RuntimeError, match="lower_matrix_ptr"):
        launch(None)


def test_a_power_of_a_power_does_not_end_the_process(f32):
    @ti.kernel
    def fourth(x: ti.f32) -> ti.f32:
        return (x**2) ** 2

    assert fourth(3.0) == 81.0
