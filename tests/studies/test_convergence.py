"""What a study makes of its pictures and times: its arithmetic by hand."""

import math

import numpy as np
import pytest
from made_up_study import found_of, made_curve, made_study, made_truth

from taichi_tracer.studies import accuracy_tables, convergence
from taichi_tracer.studies.convergence import Block
from taichi_tracer.studies.variants import Variant


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


def test_an_error_that_rises_again_was_not_reached_before():
    c = made_curve()
    errors = [0.5, 0.04, 0.04, 3.0, 1.0, 0.2]
    c.found = found_of(c.samples, [[*errors, 0.04]])
    assert c.seconds_to(0.05) == pytest.approx(0.64 * 2 ** (math.log(0.2 / 0.05) / math.log(0.2 / 0.04)))
    c.found = found_of(c.samples, [[*errors, 0.2]])
    assert math.isnan(c.seconds_to(0.05))


def test_a_seed_that_went_farther_alone_counts_where_it_was():
    c = made_curve(scale=0.1)
    for seed in (2, 3):
        c.found[seed] = dict(list(c.found[seed].items())[:-2])
    assert np.isfinite(c.mean_errors).all()
    assert c.mean_errors[-1] == c.errors[0, -1]


def test_the_best_picture_is_neither_the_last_nor_the_first():
    c = made_curve()
    c.found = found_of(c.samples, [[0.5, 0.4, 0.3, 0.2, 0.1, 0.2, 0.3], [0.5, 0.4, 0.04, *[math.nan] * 4]])
    assert c.best == (pytest.approx(0.08), 0.04)
    assert c.last == (pytest.approx(1.28), pytest.approx(0.3))


def test_the_leader_reaches_the_target_first_or_has_the_least_error_at_equal_time():
    slow, quick = (made_curve(scale=s) for s in (0.025, 0.02))
    noisy, clean = (made_curve(scale=s) for s in (0.3, 0.2))
    slow.found[1][2] = 0.001, 0.001  # one good picture is no lead
    assert convergence.leading([noisy, slow, quick, clean], 0.03) is quick
    assert convergence.leading([noisy, clean], 0.03) is clean


def test_blocks_of_one_turn_are_compared_with_each_other():
    """A machine that gets twice as slow in the middle changes no ratio."""
    load = [1, 1, 1, 2, 2, 2]
    a, b = made_curve(), made_curve(variant=Variant(precision="f64"))
    a.blocks = [Block(t, 16, 0.16 * f) for t, f in enumerate(load)]
    b.blocks = [Block(t, 16, 0.20 * f) for t, f in enumerate(load)]
    ratio, low, high = convergence.time_ratio(a, b)
    assert (ratio, low, high) == (pytest.approx(1.25),) * 3
    assert a.time_factor > 1.3


def test_the_references_own_error_is_taken_off():
    ones = np.ones((8, 8, 3))
    assert convergence.error_of(1.05 * ones, 1.0, made_truth(ones, 0.03)) == pytest.approx(0.04)
    assert convergence.error_of(1.031 * ones, 0.02, made_truth(ones, 0.03)) == 0.02
    assert convergence.error_of(ones, 1.0, made_truth(ones, 0.03)) == 0


def test_a_light_that_is_hardly_met_is_told():
    c = made_curve(variant=Variant("uniform"))
    c.unmet = (2, 1024)
    told = "uniform, niederreiter met the light in 2 of the 1,024 pixels where it is rare: its error is unknown."
    assert told in accuracy_tables.summary(made_study(c))


def test_every_pixel_is_in_the_error():
    image = np.ones((10, 10, 3))
    image[4, 5] = 1e6
    truth = made_truth(image)
    wrong = image.copy()
    wrong[4, 5] = 0
    assert truth.error_of(wrong) == pytest.approx(1e6 / 10 / image.mean())


def test_where_the_reference_is_no_better_a_picture_tells_its_own_error():
    truth = made_truth(np.ones((8, 8, 3)), 0.1)
    assert convergence.error_of(np.full((8, 8, 3), 1.12), 0.05, truth) == 0.05
    assert convergence.error_of(np.full((8, 8, 3), 1.5), 0.05, truth) == pytest.approx(math.sqrt(0.5**2 - 0.1**2))


def test_a_reference_of_fewer_pixels_is_the_mean_of_blocks(rng):
    image = rng.random((6, 8, 3))
    truth = made_truth(image, 0.1)
    truth.variance[:] = 0.04
    half = convergence.scaled(truth, 0.5)
    np.testing.assert_allclose(half.image[1, 2], image[2:4, 4:6].mean(axis=(0, 1)))
    assert half.error == pytest.approx(0.05)
    assert convergence.scaled(truth, 1.0) is truth


def test_what_few_times_tell_is_uncertain():
    """Of n times, the k-th smallest and the k-th largest enclose the median; of few, twice their distance does."""
    assert convergence.uncertainty([1.0, 1.0]) == convergence.UNKNOWN_FACTOR
    assert convergence.uncertainty([1.0, 1.1, 1.21]) == pytest.approx(1.1**2)
    assert convergence.uncertainty([1.0, 1.1, 1.21, 1.1, 1.1]) == pytest.approx(1.1)
    assert convergence.uncertainty([1.0] * 9 + [50.0]) == 1


def test_the_interval_of_a_median_contains_it_in_95_of_100_cases(rng):
    for n in (6, 9, 12, 20):
        factors = rng.lognormal(0, 0.3, (2000, n))
        held = [abs(np.log(np.median(f))) <= np.log(convergence.uncertainty(list(f))) for f in factors]
        assert np.mean(held) > 0.93, n
