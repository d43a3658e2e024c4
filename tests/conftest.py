"""Taichi in each precision, and random numbers."""

import os

import numpy as np
import pytest
from support import long_except, start


@pytest.fixture(scope="module")
def f32():
    """Taichi in f32."""
    start("f32")


@pytest.fixture(scope="module", params=long_except(["f32", "f64"], "f32"))
def precision(request):
    """Taichi in each precision; its name."""
    start(request.param)
    return request.param


@pytest.fixture
def rng():
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20)


def pytest_collection_modifyitems(items):
    """Skip the tests that are marked long, unless TAICHI_TRACER_LONG=1 asks for them, as .ci/run does.

    A test is long if it takes seconds and repeats what shorter tests check: by the command line, on more scenes or with
    more samples.
    """
    if os.environ.get("TAICHI_TRACER_LONG") == "1":
        return
    for item in items:
        if item.get_closest_marker("long") is not None:
            item.add_marker(pytest.mark.skip(reason="long: TAICHI_TRACER_LONG=1 runs it"))
