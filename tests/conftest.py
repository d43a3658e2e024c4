"""Taichi in each precision, and random numbers."""

import os

import numpy as np
import pytest
from support import start

from taichi_tracer.system import runtime
from taichi_tracer.system.parts import PARTS

# Taichi keeps 100 MB of compiled kernels; those of all tests are more, and would push each other out in every run.
os.environ.setdefault("TI_OFFLINE_CACHE_MAX_SIZE_OF_FILES", str(10**9))


@pytest.fixture(scope="module")
def f32():
    """Taichi in f32."""
    start("f32")


@pytest.fixture(scope="module", params=["f32"])
def precision(request):
    """Taichi in each precision; its name."""
    start(request.param)
    return request.param


@pytest.fixture(scope="module", autouse=True)
def single_precision_afterwards():
    """A file that names no precision has f32, whichever file ran before it."""
    yield
    if (settings := runtime.current()) and settings.precision != "f32":
        start("f32")


@pytest.fixture(scope="module", autouse=True)
def own_parts():
    """What a test file registers, and its modules load, is no part of the tests of other files."""
    before = [*PARTS.everything()]
    yield
    for part in PARTS.everything():
        if not PARTS.comes_with_package(part) and not any(part is one for one in before):
            PARTS.remove(part)


@pytest.fixture
def rng():
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20)
