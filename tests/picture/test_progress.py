"""Rendering ends at the first target, and what is predicted comes about."""

import math

import pytest

import taichi_tracer as tt
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.progress import Progress, Target


def told(value):
    return RelativeError(value, value / 1.1, value * 1.1)


def simulate(power, target, per_sample=0.01):
    """A rendering whose error falls as n^power exactly; returns [(samples, predicted total seconds)], and the end."""
    progress, predictions = Progress(Target(error=target)), []
    while not progress.is_done:
        progress.took(per_sample, on_kernels=1.0 if progress.samples == 0 else 0.0)
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


def test_the_first_target_ends_it():
    progress = Progress(Target(spp=5, time=1.0))
    for _ in range(5):
        assert not progress.is_done
        progress.took(0.1)
    assert progress.is_done
    slow = Progress(Target(spp=1000, time=1.0))
    while not slow.is_done:
        slow.took(0.1)
    assert slow.samples == 10
    assert slow.seconds_left < 0.05


def test_a_small_error_after_few_samples_is_not_believed():
    progress = Progress(Target(error=0.5))
    while not progress.is_done:
        progress.took(0.001)
        progress.look(lambda: told(0.01))
    assert progress.samples == 8


@pytest.mark.parametrize(
    ("name", "value"), [("spp", 0), ("spp", 1.5), ("time", 0), ("time", -1), ("time", math.inf), ("error", math.nan)]
)
def test_targets_that_are_none_are_refused(name, value):
    with pytest.raises(tt.InputError, match=f"render: {name} must be"):
        Target(**{name: value})
