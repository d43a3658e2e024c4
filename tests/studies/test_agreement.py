"""Do estimators agree? Those of the package do, and a wrong weight is found."""

import numpy as np
import pytest

from taichi_tracer.apps.commands import accuracy as command
from taichi_tracer.studies.agreement import Compared, Group, block_scores


def noisy(rng, mean, deviation=0.1, shape=(32, 32, 3)):
    """A picture with normal noise, and its variance."""
    noise = rng.normal(size=shape[:2])[..., None] * np.ones(3)
    return mean + deviation * noise, np.full(shape, deviation**2)


def test_scores_of_blocks_are_normal(rng):
    scores = [block_scores(noisy(rng, 1.0), noisy(rng, 1.0), 0.0) for _ in range(100)]
    assert scores[0].shape == (4, 4)
    assert np.std(scores) == pytest.approx(1, abs=0.1)
    assert np.mean(scores) == pytest.approx(0, abs=0.1)


def test_light_that_no_sample_met_is_noise_of_every_block(rng):
    one, other = noisy(rng, 1.0, 0.01), noisy(rng, 1.1, 0.01)
    assert abs(block_scores(one, other, 0.0)).min() > 20
    assert abs(block_scores(one, other, 0.2)).max() < 1
    black = np.zeros((32, 32, 3)), np.zeros((32, 32, 3))
    assert (block_scores(black, black, 0.0) == 0).all()


def group(z: float, unseen: float = 0.0) -> Group:
    """Two estimators that differ by z."""
    one = Compared("brdf", -0.031, 0.004, z, 3.0, np.array([[z, 0.0], [z, 1.0]]), unseen)
    return Group("direct light", "mis", 0.012, (one,))


def test_what_is_told():
    head, line = command.lines_of(group(-7.75))
    assert head == "direct light: compared with mis, whose error is 1.2 %"
    told = "brdf -3.10 % ± 0.40 % differs: too dark (z -7.8), above all in 2 of 4 blocks"
    assert " ".join(line.split()) == told
    assert not group(-7.75).agrees
    assert command.lines_of(group(1.0))[1].endswith("agrees")
    assert command.lines_of(group(1.0, 0.5))[1].endswith("agrees; light that no sample met may hide 50 %")
    assert "unknown" in command.lines_of(group(float("nan")))[1]
    text = command.as_page("<scene>", [group(-7.75)])
    assert "&lt;scene&gt;" in text
    assert text.count("<img") == 1
