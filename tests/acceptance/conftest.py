"""Taichi on the CPU in f32 for every acceptance test."""

import pytest

import taichi_tracer as tt


@pytest.fixture(scope="module", autouse=True)
def f32():
    """Taichi on the CPU in f32."""
    tt.init("cpu")
