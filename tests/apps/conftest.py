"""Taichi for the tests that call the command line within this process: its defaults, on the CPU."""

import pytest

from taichi_tracer.system import runtime


@pytest.fixture(scope="module", autouse=True)
def default_taichi():
    if runtime.current() != runtime.Settings("cpu", "f32", False):
        runtime.init("cpu", force=True)
