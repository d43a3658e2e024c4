"""Rendering ends at the first target, and what is predicted comes about."""

import math

import pytest

import taichi_tracer as tt
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.progress import Progress, Target, slope


def told(value):
    return RelativeError(value, value / 1.1, value * 1.1)


def simulate(power, target, per_sample=0.01):
    """A rendering whose error falls as n^power exactly; returns [(samples, predicted total seconds)], and the end."""
    progress, predictions = Progress(Target(error=target)), []
    while not progress.is_done:
        progress.took(per_sample + (1.0 if progress.samples == 0 else 0.0), compiles=progress.samples == 0)
        progress.look(lambda: told(progress.samples**power))
        predictions.append((progress.samples, progress.seconds + progress.seconds_left))
    return predictions, progress


@pytest.mark.parametrize("power", [-0.5, -0.6, -0.75])
def test_the_prediction_at_a_tenth_of_the_way_is_within_a_quarter(power):
    predictions, progress = simulate(power, 0.02)
    end = progress.samples
    assert end == pytest.approx((0.02 / 1.1) ** (1 / power), rel=0.03)  # the upper end reaches the target
    at_a_tenth = next(total for n, total in predictions if n >= end / 10)
    assert at_a_tenth == pytest.approx(progress.seconds, rel=0.25)


def test_compilation_is_told_apart():
    _, progress = simulate(-0.5, 0.05)
    assert progress.compile_seconds == pytest.approx(1.0, rel=0.02)
    assert progress.seconds == pytest.approx(0.01 * progress.samples, rel=0.1)


def test_seconds_of_kernels_are_never_those_of_rendering():
    """Also after a single pass, with which nothing can be compared."""
    progress = Progress(Target(spp=1))
    progress.took(0.02, compiles=True, on_kernels=3.0)
    assert (progress.seconds, progress.compile_seconds) == (pytest.approx(0.02), pytest.approx(3.0))
    assert progress.seconds_per_sample == 0.02
    progress.took(0.01)
    assert (progress.seconds, progress.compile_seconds) == (pytest.approx(0.02), pytest.approx(3.01))


def test_progress_in_steps_of_many_samples():
    """Of a cluster, which begins with a preparation; its first sums bring many samples."""
    progress = Progress(Target(spp=100))
    progress.took(3.0, 0, compiles=True)
    progress.took(2.0, 40)
    assert (progress.samples, progress.seconds_per_sample) == (40, 0.05)
    assert (progress.seconds, progress.compile_seconds) == (pytest.approx(2.0), pytest.approx(3.0))
    assert progress.seconds_left == pytest.approx(60 * 0.05)


def test_passes_in_which_few_pixels_take_samples():
    """Of an adaptive picture: twelve passes are one sample of every pixel on average."""
    progress = Progress(Target(spp=10, time=1.0))
    progress.took(1.0, 1 / 12, compiles=True)
    for _ in range(59):
        progress.took(0.01, 1 / 12)
    assert progress.samples == pytest.approx(5)
    assert progress.seconds_per_sample == pytest.approx(0.12)
    assert (progress.seconds, progress.compile_seconds) == (pytest.approx(0.6), pytest.approx(0.99))
    assert progress.seconds_left == pytest.approx(0.4)
    assert progress.samples_to_come == pytest.approx(0.4 / 0.12)
    while not progress.is_done:
        progress.took(0.01, 1 / 12)
    assert progress.seconds == pytest.approx(1.0, abs=0.011)


def test_several_passes_at_once_never_go_beyond_a_target():
    progress = Progress(Target(spp=3, time=10.0))
    assert progress.passes_until_a_look(12) == 1  # nobody knows yet how long they take
    progress.took(1.0, 1 / 12, compiles=True)
    progress.took(0.001, 1 / 12)
    assert (progress.passes_until_a_look(12), progress.passes_until_a_look(1)) == (12, 1)
    while not progress.is_done:
        passes = progress.passes_until_a_look(12)
        progress.took(0.001 * passes, 1 / 12, passes=passes)
    assert progress.samples == pytest.approx(3)
    slow = Progress(Target(time=1.0))
    slow.took(0.03, 1 / 12)
    assert slow.passes_until_a_look(12) == 3  # a tenth of a second
    while not slow.is_done:
        passes = slow.passes_until_a_look(12)
        slow.took(0.03 * passes, 1 / 12, passes=passes)
    assert slow.seconds == pytest.approx(1.0, abs=0.016)
    looks = Progress(Target(error=0.01))
    looks.took(0.001, 1 / 12)
    assert looks.passes_until_a_look(100) == 23  # the first estimate comes after two samples


def test_the_first_target_ends_it():
    progress = Progress(Target(spp=5, time=1.0))
    for _ in range(5):
        assert not progress.is_done
        progress.took(0.1, compiles=progress.samples == 0)
    assert progress.is_done
    slow = Progress(Target(spp=1000, time=1.0))
    while not slow.is_done:
        slow.took(0.1, compiles=slow.samples == 0)
    assert slow.samples == 10
    assert slow.seconds_left < 0.05


def test_few_looks_before_an_error_may_end_it():
    """2, 4 and 8 samples show how it falls; more looks would take as long as the samples of a small picture."""
    progress = Progress(Target(error=0.01))
    for _ in range(13):
        progress.took(0.01)
        progress.look(lambda: told(progress.samples**-0.5))
    assert [n for n, _ in progress.looks] == [2, 4, 8, 10, 13]


def test_a_small_error_after_few_samples_is_not_believed():
    progress = Progress(Target(error=0.5))
    while not progress.is_done:
        progress.took(0.001)
        progress.look(lambda: told(0.01))
    assert progress.samples == 8


@pytest.mark.parametrize("target", [Target(spp=100), Target(time=10.0)])
def test_what_is_over_soon_is_not_looked_at(target):
    progress, looked_at = Progress(target), []
    for _ in range(30):
        progress.took(0.1)
        progress.look(lambda: looked_at.append(progress.seconds) or told(0.01))
    assert looked_at[0] == pytest.approx(1.0, abs=0.11)


def test_slope_of_a_straight_line():
    assert slope([(n, 3 * n**-0.7) for n in (1, 5, 20, 90)]) == pytest.approx(-0.7)


@pytest.mark.parametrize(
    ("name", "value"), [("spp", 0), ("spp", 1.5), ("time", 0), ("time", -1), ("time", math.inf), ("error", math.nan)]
)
def test_targets_that_are_none_are_refused(name, value):
    with pytest.raises(tt.InputError, match=f"render: {name} must be"):
        Target(**{name: value})


def test_per_cent_in_the_place_of_a_fraction_are_refused():
    with pytest.raises(tt.InputError, match="render: error is a fraction, 0.05 for 5 %, and at most 1"):
        Target(error=5)


def test_progress_is_shown_in_words():
    progress = Progress(Target(spp=10))
    assert repr(progress) == "Progress(0 samples)"
    progress.took(2.0, compiles=True)
    progress.took(0.5)
    progress.error = RelativeError(0.02, 0.018, 0.022)
    assert repr(progress) == f"Progress(2 samples, 1.00 s of rendering, 1.50 s of compiling, error {progress.error})"
