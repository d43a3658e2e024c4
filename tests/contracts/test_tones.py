"""Every registered tone curve keeps its contract; those that break it in one point are found."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts.tones import check_tone
from taichi_tracer.system.compile_time import compile_time


class Lifted(tt.Tone):
    name = "broken: lifts black"

    @compile_time
    def curve(self, x):
        return 0.1 + 0.9 * x


class Wave(tt.Tone):
    name = "broken: goes back"

    @compile_time
    def curve(self, x):
        return x * (4 - 3 * x)


class Grey(tt.Tone):
    name, white = "broken: white stays grey", 4.0

    @compile_time
    def curve(self, x):
        return x / (1 + x)


class TwoFormulas(tt.Tone):
    name = "broken: kernels differ"

    @compile_time
    def curve(self, x):
        return x if isinstance(x, np.ndarray) else x * x


BROKEN = {Lifted: "0 becomes 0.1", Wave: "it decreases", Grey: "white, 4, becomes", TwoFormulas: "a kernel and Python"}


@pytest.fixture(scope="module", autouse=True)
def f32():
    start("f32")


@every("tone curve")
def test_tone(part):
    check_tone(part)


@broken_parts(BROKEN)
def test_broken_tone_is_found(broken, reason):
    check_fails(broken, check_tone, reason)
