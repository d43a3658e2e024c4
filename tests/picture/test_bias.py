"""A bias is told from noise, on made-up noise."""

import math

import numpy as np
import pytest

from taichi_tracer.picture import metrics


def test_bias_is_found_and_none_is_not_invented(rng):
    """z-scores of 40 unbiased sets of pictures have a spread of 1 (p < 1e-4 outside); a shift of 10 errors is seen."""
    truth = np.ones((32, 32, 3)), np.zeros((32, 32, 3))

    def pictures(shift):
        noise = np.repeat(rng.normal(size=(3, 32, 32, 1)), 3, axis=3)
        return [(1 + shift + 0.1 * n, np.full((32, 32, 3), 0.01)) for n in noise]

    found = np.array([metrics.shift_of(pictures(0), truth) for _ in range(40)])
    assert 0.6 < np.std(found[:, 0] / found[:, 1]) < 1.5
    assert 0.5 < np.std(found[:, 2]) < 1.5
    shift, error, z = metrics.shift_of(pictures(10 * 0.1 / math.sqrt(3 * 1024)), truth)
    assert shift > 5 * error
    assert z > 5
    assert shift == pytest.approx(10 * 0.1 / math.sqrt(3 * 1024), rel=0.4)


def test_one_pixel_with_a_rare_light_is_no_bias(rng):
    """A sun in a mirror that the reference has met, and the pictures have not, shifts the whole mean, not the z."""
    image = np.ones((32, 32, 3))
    image[4, 5] = 1e6
    truth = image, np.zeros_like(image)
    finals = []
    for _ in range(3):
        picture = 1 + 0.1 * np.repeat(rng.normal(size=(32, 32, 1)), 3, axis=2)
        finals.append((picture, np.full((32, 32, 3), 0.01)))
    shift, error, z = metrics.shift_of(finals, truth)
    assert abs(shift) > 100 * error
    assert abs(z) < 4
    assert metrics.shift_of(finals, truth, unseen=2.0)[1] > 2
