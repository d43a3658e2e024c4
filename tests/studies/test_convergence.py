"""What a study makes of its pictures and times: its arithmetic by hand."""

import math

import numpy as np
import pytest
from made_up_study import made_curve, made_truth

from taichi_tracer.studies import convergence


def test_seconds_to_an_error_are_measured_or_unknown():
    """Between two pictures that were measured; what was not reached is not extrapolated."""
    c = made_curve(-0.5, scale=0.02)
    assert c.slope == pytest.approx(-0.5)
    assert c.seconds_to(0.05) == pytest.approx(0.16)
    assert c.seconds_to(0.5) == pytest.approx(0.02)
    assert math.isnan(c.seconds_to(0.002))
    assert c.last == (pytest.approx(1.28), pytest.approx(0.02 * 1.28**-0.5))
    assert c.milliseconds_per_sample == pytest.approx(10)
    assert c.variance_times_time == pytest.approx(0.02**2)


def test_the_references_own_error_is_taken_off():
    ones = np.ones((8, 8, 3))
    assert convergence.error_of(1.05 * ones, 1.0, made_truth(ones, 0.03)) == pytest.approx(0.04)
    assert convergence.error_of(1.031 * ones, 0.02, made_truth(ones, 0.03)) == 0.02
    assert convergence.error_of(ones, 1.0, made_truth(ones, 0.03)) == 0


def test_a_reference_of_fewer_pixels_is_the_mean_of_blocks(rng):
    image = rng.random((6, 8, 3))
    truth = made_truth(image, 0.1)
    truth.variance[:] = 0.04
    half = convergence.scaled(truth, 0.5)
    np.testing.assert_allclose(half.image[1, 2], image[2:4, 4:6].mean(axis=(0, 1)))
    assert half.error == pytest.approx(0.05)
    assert convergence.scaled(truth, 1.0) is truth


def test_the_interval_of_a_median_contains_it_in_95_of_100_cases(rng):
    for n in (6, 9, 12, 20):
        factors = rng.lognormal(0, 0.3, (2000, n))
        held = [abs(np.log(np.median(f))) <= np.log(convergence.uncertainty(list(f))) for f in factors]
        assert np.mean(held) > 0.93, n
