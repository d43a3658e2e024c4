"""What is said about an error that no known mistake explains."""

import math

import numpy as np
import pytest

from taichi_tracer.teaching.handout.descriptions import describe

RNG = np.random.default_rng(4)
RIGHT = RNG.normal(size=(50, 3))


def told(yours, right=RIGHT):
    """The descriptions of one answer that is wrong everywhere."""
    return describe({"v": np.asarray(yours)}, {"v": np.asarray(right)}, np.zeros(len(right), bool))


@pytest.mark.parametrize(
    ("yours", "text"),
    [
        (RIGHT * [1, -1, 1], "v is mirrored: its y has the opposite sign"),
        (-RIGHT, "v points the opposite way"),
        (RIGHT[:, [1, 0, 2]], "v has its x and its y exchanged"),
        (2 * RIGHT, "v is scaled by 2"),
        (RIGHT / 4, "v is scaled by 1/4"),
        (math.pi * RIGHT, "v is scaled by π"),
        (RIGHT + [1, 0, 0.5], "v has a constant offset: 1, 0, 0.5"),
        (0 * RIGHT, "v is always 0"),
        (0 * RIGHT + 7, "v is the same for every input"),
        (1 - RIGHT, "v is 1 minus the right number"),
        (RIGHT + np.outer(RNG.normal(size=50), [0, 0, 1]), "v is right but for its z"),
        (np.full((50, 3), np.nan), "v is not a finite number in 50 of 50 cases"),
        (RIGHT[:, :2], "the answer 'v' has another shape than it should"),
    ],
)
def test_vectors(yours, text):
    assert told(yours) == [text]


def test_hits_that_are_missed():
    count = 40
    right = {"is_hit": np.ones(count, np.int32), "distance": np.linspace(1, 2, count)}
    missed = {**right, "is_hit": np.where(np.arange(count) < 5, 0, 1)}
    assert describe(missed, right, np.arange(count) >= 5) == ["5 hits are missed"]
