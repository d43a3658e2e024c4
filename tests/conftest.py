"""Taichi in each precision, and random numbers."""

import os

import numpy as np
import pytest
from support import start


@pytest.fixture(scope="module")
def f32():
    """Taichi in f32."""
    start("f32")


@pytest.fixture(scope="module", params=["f32", pytest.param("f64", marks=pytest.mark.exhaustive)])
def precision(request):
    """Taichi in each precision; its name."""
    start(request.param)
    return request.param


@pytest.fixture
def rng():
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20)


def pytest_collection_modifyitems(items):
    """Skip the tests that are marked long or exhaustive, unless TAICHI_TRACER_LONG asks for them.

    A test is long if it takes seconds and repeats what shorter tests check: by the command line, on more scenes or with
    more samples; TAICHI_TRACER_LONG=1 runs it, as .ci/run does. It is exhaustive if it repeats what long tests check,
    with everything that the package has; TAICHI_TRACER_LONG=all runs it.
    """
    asked = os.environ.get("TAICHI_TRACER_LONG")
    skipped = {None: {"long": "1", "exhaustive": "all"}, "1": {"exhaustive": "all"}}.get(asked, {})
    for item in items:
        for mark, value in skipped.items():
            if item.get_closest_marker(mark) is not None:
                item.add_marker(pytest.mark.skip(reason=f"{mark}: TAICHI_TRACER_LONG={value} runs it"))
