"""Differences of pictures, against sums by hand."""

import math

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.picture import metrics


def test_numbers_by_hand():
    image = np.array([[[1.5, 0.25, 0.0], [3.0, 1.0, 0.125]]], np.float32)
    reference = np.array([[[1.0, 0.25, 0.5], [2.0, 0.0, 0.125]]], np.float32)
    assert metrics.rmse(image, reference) == pytest.approx(math.sqrt(2.5 / 6))
    assert metrics.relative_rmse(image, reference) == pytest.approx(math.sqrt(2.5 / 6) / (3.875 / 6))
    expected = (0.25 / 1.01**2 + 0.25 / 0.51**2 + 1 / 2.01**2 + 1 / 0.01**2) / 6
    assert metrics.rel_mse(image, reference) == pytest.approx(expected, rel=1e-6)


def test_black_references():
    black = np.zeros((2, 2, 3))
    assert metrics.relative_rmse(black, black) == 0
    assert metrics.relative_rmse(black + 1, black) == math.inf


def test_flip_grows_with_what_is_seen(rng):
    reference = np.full((16, 16, 3), 0.3)
    slight, strong = reference + rng.normal(0, 0.01, reference.shape), reference + rng.normal(0, 0.2, reference.shape)
    values = [metrics.flip(p, reference)[0] for p in (reference, slight, strong)]
    assert values[0] == pytest.approx(0, abs=1e-6)
    assert values[0] < values[1] < values[2] < 1
    assert metrics.flip(strong, reference)[1].shape == (16, 16)
    bright = reference + 100
    assert metrics.flip(bright, bright + 50)[0] == pytest.approx(0, abs=1e-6), "a screen shows both as white"


def test_other_sizes_are_refused():
    with pytest.raises(tt.InputError, match="2x1 and 1x2 pixels cannot be compared"):
        metrics.check_same_size(np.zeros((1, 2, 3)), np.zeros((2, 1, 3)))
