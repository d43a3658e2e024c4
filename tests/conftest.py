"""Taichi in each precision, and random numbers."""

import numpy as np
import pytest
from support import start


@pytest.fixture(scope="module")
def f32():
    """Taichi in f32."""
    start("f32")


@pytest.fixture(scope="module", params=["f32", "f64"])
def precision(request):
    """Taichi in each precision; its name."""
    start(request.param)
    return request.param


@pytest.fixture
def rng():
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20)
