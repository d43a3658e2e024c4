"""What a second run is spared is told by the seconds of each translation into machine code."""

from types import SimpleNamespace

import pytest

from taichi_tracer.system import compiling


def test_only_what_was_not_found_counts(monkeypatch):
    calls = []
    program = SimpleNamespace(Program=SimpleNamespace(compile_kernel=lambda *words: calls.append(words) or "kernel"))
    ticks = iter([0.0, 0.5, 1.0, 1.001, 2.0, 3.0])
    monkeypatch.setattr(compiling, "core", program)
    monkeypatch.setattr(compiling, "_is_watched", False)
    monkeypatch.setattr(compiling, "_spent", [])
    monkeypatch.setattr(compiling, "perf_counter", lambda: next(ticks))
    compiling.watch()
    compiling.watch()  # once is enough
    assert [program.Program.compile_kernel(i) for i in range(3)] == ["kernel"] * 3
    assert calls == [(0,), (1,), (2,)]
    assert compiling.kernels_made() == 2
    assert compiling.seconds_to_save() == pytest.approx(1.5)


def test_a_taichi_without_that_method_is_left_alone(monkeypatch):
    monkeypatch.setattr(compiling, "core", SimpleNamespace(Program=SimpleNamespace()))
    monkeypatch.setattr(compiling, "_is_watched", False)
    compiling.watch()
    assert not hasattr(compiling.core.Program, "compile_kernel")


def test_each_kernel_has_a_name_and_its_seconds(monkeypatch):
    made = []

    class Program:
        def create_kernel(self, build, name, mode):
            made.append(SimpleNamespace(name=name))
            return made[-1]

        def compile_kernel(self, config, capabilities, kernel):
            return "code"

    ticks = iter([1.0, 1.5, 2.0, 2.01, 3.0, 3.1, 4.0, 5.0, 6.0, 9.0])
    monkeypatch.setattr(compiling, "core", SimpleNamespace(Program=Program))
    for name, empty in (("_is_watched", False), ("_spent", []), ("_kernels", []), ("_by_id", {})):
        monkeypatch.setattr(compiling, name, empty)
    monkeypatch.setattr(compiling, "perf_counter", lambda: next(ticks))
    busy = iter([0.0, 0.01, 1.0, 1.5, 2.0])
    monkeypatch.setattr(compiling, "thread_time", lambda: next(busy))
    compiling.watch()
    program = Program()
    first = program.create_kernel(None, "_take_sample_c76_0", "mode")
    assert program.compile_kernel(None, None, first) == "code"
    second = program.create_kernel(None, "_clear_c4_1", "mode")
    program.compile_kernel(None, None, second)
    program.compile_kernel(None, None, second)  # a later launch, however long it took
    told = [(kernel.name, kernel.read_at, kernel.is_new) for kernel in compiling.kernels()]
    assert told == [("_take_sample", 1.0, False), ("_clear", 3.0, True)]
    assert [kernel.reading for kernel in compiling.kernels()] == pytest.approx([0.5, 0.1])
    assert [kernel.translating for kernel in compiling.kernels()] == pytest.approx([0.01, 1.0])
    assert not compiling.Kernel("a large one, loaded", 0.0, reading=1.0, translating=0.1, processor=0.05).is_new
    assert [kernel.name for kernel in compiling.kernels(since=2.5)] == ["_clear"]
