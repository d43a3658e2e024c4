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
