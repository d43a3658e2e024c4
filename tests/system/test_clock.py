"""The time since the key press: what the system says, or since the package was imported."""

import subprocess
import sys
import time

import pytest

from taichi_tracer.system import clock

CODE = "import time; time.sleep(0.3); from taichi_tracer.system import clock; print(clock.seconds_since_start())"


@pytest.mark.skipif(sys.platform == "darwin", reason="macOS does not tell it")
def test_what_python_took_to_start_is_in_it():
    start = time.perf_counter()
    told = float(subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True).stdout)
    assert 0.3 < told < time.perf_counter() - start + 0.02  # ticks of the system have 10 ms


def test_a_system_that_does_not_tell_it_counts_from_the_import(monkeypatch):
    monkeypatch.setattr(clock.sys, "platform", "darwin")
    assert clock._since_start() == 0


def test_the_start_stays_where_it_was():
    before = time.perf_counter() - clock._IMPORTED
    told = clock.seconds_since_start() - clock._BEFORE
    assert before <= told <= time.perf_counter() - clock._IMPORTED
    assert clock.started_at() == pytest.approx(clock._IMPORTED - clock._BEFORE, abs=0.01)
