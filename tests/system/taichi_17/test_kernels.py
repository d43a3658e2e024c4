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


def test_what_a_gpu_cannot_compile_is_one_line():
    def fails(*_words):
        raise RuntimeError("[lower_matrix_ptr.cpp:visit@535] not dynamic indexable.\nFile ...")

    translate = kernels.counting_translating(fails)
    kernel = SimpleNamespace()
    with pytest.raises(InputError, match=r"^vulkan cannot compile a kernel \(.*not dynamic indexable.\): use the CPU"):
        translate(SimpleNamespace(arch=ti.vulkan), None, kernel)
    with pytest.raises(RuntimeError, match="lower_matrix_ptr"):
        translate(SimpleNamespace(arch=ti.x64), None, kernel)


def test_a_power_of_a_power_does_not_end_the_process(f32):
    @ti.kernel
    def fourth(x: ti.f32) -> ti.f32:
        return (x**2) ** 2

    assert fourth(3.0) == 81.0
