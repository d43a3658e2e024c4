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
    more samples. TAICHI_TRACER_LONG=1 runs the first case of each long test, as .ci/run does. A test is exhaustive if
    it repeats what long tests check, with everything that the package has. TAICHI_TRACER_LONG=all runs every case of
    every test.
    """
    asked = os.environ.get("TAICHI_TRACER_LONG")
    begun = set()
    for item in items:
        marks = {mark.name for mark in item.iter_markers()}
        if asked != "all" and "exhaustive" in marks:
            item.add_marker(pytest.mark.skip(reason="exhaustive: TAICHI_TRACER_LONG=all runs it"))
        elif asked != "all" and "long" in marks:
            test = item.path, item.originalname
            if asked is None or test in begun:
                runs = "all" if test in begun else "1"
                item.add_marker(pytest.mark.skip(reason=f"long: TAICHI_TRACER_LONG={runs} runs it"))
            begun.add(test)
