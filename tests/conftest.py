"""Taichi starts once per precision and module; TAICHI_TRACER_DEBUG=1 checks the bounds of every read (slow)."""

import os
from pathlib import Path

import numpy as np
import pytest

from taichi_tracer import runtime

DEBUG = os.environ.get("TAICHI_TRACER_DEBUG") == "1"
DATA = Path(__file__).parent.parent.parent / "shared" / "data"


def start(precision: str = "f32", **options) -> None:
    """Taichi on the CPU in a precision, whatever ran before."""
    wanted = runtime.Settings("cpu", precision, options.get("fast_math", False))
    if runtime.current() != wanted or options:
        runtime.init("cpu", precision, force=True, debug=DEBUG, **options)


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


def data_file(name: str) -> Path:
    """A real mesh from beside the checkout; the test is skipped where there is none."""
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    return path
