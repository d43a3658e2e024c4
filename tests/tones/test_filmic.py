"""The filmic curve against its source, written out in float64, and the values that its docstring names."""

import numpy as np
import pytest
from oracles import tones

from taichi_tracer.system.parts import PARTS
from taichi_tracer.tones.filmic import Filmic, hable

FILMIC = PARTS.find("tone curve", "filmic")


def test_the_curve_is_that_of_the_source():
    x = np.concatenate([[0.0], np.geomspace(1e-8, FILMIC.white, 1000)])
    np.testing.assert_allclose(FILMIC.curve(x), tones.uncharted2(x), rtol=1e-12, atol=1e-15)


def test_black_stays_black_exactly():
    for dtype in (np.float32, np.float64):
        assert hable(dtype(0)) == 0


@pytest.mark.parametrize(("x", "y"), [(0.18, 0.13), (1.0, 0.49), (5.6, 1.0)])
def test_the_docstring_names_true_values(x, y):
    assert round(float(FILMIC.curve(np.float64(x))), 2) == y
    assert f"{x:g}" in Filmic.__doc__


def test_white_is_the_white_point_over_the_bias():
    assert FILMIC.white == pytest.approx(5.6)
    assert FILMIC.curve(np.float64(FILMIC.white)) == pytest.approx(1, abs=1e-15)
