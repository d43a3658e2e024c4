"""The rows of a profile add up, and every kernel is there."""

import pytest

from taichi_tracer.studies.tables import profile
from taichi_tracer.system.compiling import Kernel
from taichi_tracer.system.stopwatch import IMPORTS, OTHER, SAMPLES, STAGES, Stopwatch


def test_the_text_has_every_row():
    watch = Stopwatch(0.0, IMPORTS)
    watch.seconds = dict.fromkeys(STAGES, 0.0) | {IMPORTS: 2.0, SAMPLES: 7.0, OTHER: 1.0}
    watch._since = 10.0
    kernels = [Kernel("_take_samples", 1.0, 0.5, 1.25, 0.9), Kernel("_clear", 2.0, 0.01, 0.002, 0.002)]
    lines = profile(watch, kernels)
    assert sum(float(lines[k].rpartition(" s ")[0].split()[-1]) for k in range(len(STAGES))) == pytest.approx(10)
    assert "70.0 %" in lines[STAGES.index(SAMPLES)]
    assert "2 kernels, 1 of them translated anew (1.25 s)" in lines
    assert lines[-1] == "  _clear: read in 0.010 s, loaded in 0.002 s"
