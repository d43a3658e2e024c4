"""Around the reading and the translating of a kernel: what is counted."""

from types import SimpleNamespace

import pytest
import taichi as ti

from taichi_tracer.system import compiling
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.taichi_17 import kernels


@pytest.fixture(autouse=True)
def nothing_counted(monkeypatch):
    """No kernel is known yet."""
    for name, empty in (("_spent", []), ("_kernels", []), ("_by_id", {})):
        monkeypatch.setattr(compiling, name, empty)


def test_each_kernel_has_a_name_and_its_seconds(monkeypatch):
    ticks, busy = iter([1.0, 1.5, 2.0, 2.01, 3.0, 3.1, 4.0, 5.0, 6.0, 9.0]), iter([0.0, 0.01, 1.0, 1.5, 2.0, 2.0])
    monkeypatch.setattr(kernels, "perf_counter", lambda: next(ticks))
    monkeypatch.setattr(kernels, "thread_time", lambda: next(busy))
    create = kernels.counting_reading(lambda program, build, name, mode: SimpleNamespace(name=name))
    translate = kernels.counting_translating(lambda config, capabilities, kernel: "code")
    first = create(None, None, "_take_sample_c76_0", "mode")
    assert translate(None, None, first) == "code"
    second = create(None, None, "_clear_c4_1", "mode")
    translate(None, None, second)
    translate(None, None, second)  # a later launch, however long it took
    told = [(kernel.name, kernel.read_at, kernel.is_new) for kernel in compiling.kernels()]
    assert told == [("_take_sample", 1.0, False), ("_clear", 3.0, True)]
    assert [kernel.reading for kernel in compiling.kernels()] == pytest.approx([0.5, 0.1])
    assert [kernel.translating for kernel in compiling.kernels()] == pytest.approx([0.01, 1.0])
    assert [kernel.name for kernel in compiling.kernels(since=2.5)] == ["_clear"]


def test_what_a_gpu_cannot_compile_is_one_line():
    def fails(*_words):
        raise RuntimeError("[lower_matrix_ptr.cpp:visit@535] not dynamic indexable.\nFile ...")

    translate = kernels.counting_translating(fails)
    kernel = SimpleNamespace()
    with pytest.raises(InputError, match=r"^vulkan cannot compile a kernel \(.*not dynamic indexable.\): use the CPU"):
        translate(SimpleNamespace(arch=ti.vulkan), None, kernel)
    with pytest.raises(RuntimeError, match="lower_matrix_ptr"):
        translate(SimpleNamespace(arch=ti.x64), None, kernel)
