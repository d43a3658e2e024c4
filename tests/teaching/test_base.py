"""Judges: rounding is right, a wrong number is wrong, and right samples hardly ever fail."""

import numpy as np
import pytest

from taichi_tracer.teaching.base import Numbers, Samples, compare_pictures, statistics, z_scores

RNG = np.random.default_rng(7)


def test_right_samples_hardly_ever_fail():
    """Of 600 answers with right samples, none fails one of its tests, and z is distributed normally."""
    largest = []
    for _ in range(600):
        yours, right = (statistics(RNG.uniform(0, 1, (1, 1024, 2))) for _ in range(2))
        largest.append(np.abs(z_scores(yours, right)).max())
    assert max(largest) < 5.5
    assert 1.0 < np.median(largest) < 1.6


def test_wrong_samples_fail():
    right = statistics(RNG.uniform(0, 1, (3, 4096, 2)))
    for wrong in (RNG.uniform(0, 1.1, (3, 4096, 2)), np.repeat(RNG.uniform(0, 1, (3, 4096, 1)), 2, axis=2)):
        assert not Samples().agrees({}, {"x": statistics(wrong)}, {"x": right}).any()


def test_a_picture_may_differ_at_a_few_edges():
    right = {"picture": RNG.uniform(0, 1, (20, 30, 3))}
    few, many = right["picture"].copy(), right["picture"].copy()
    few[0, :5] = 9
    many[:10] = 9
    assert compare_pictures({}, {"picture": few}, right).status == "right"
    verdict = compare_pictures({}, {"picture": many}, right)
    assert (verdict.status, verdict.share) == ("wrong", pytest.approx(0.5, abs=2e-3))
    assert set(verdict.pictures) == {"yours", "right", "difference"}


def test_a_random_picture_may_differ_by_its_error():
    right = {"picture": np.full((8, 8, 3), 1.0), "error": np.full((8, 8, 3), 0.1)}
    near = {"picture": np.full((8, 8, 3), 1.3), "error": np.full((8, 8, 3), 0.1)}
    far = {"picture": np.full((8, 8, 3), 3.0), "error": np.full((8, 8, 3), 0.1)}
    assert compare_pictures({}, near, right).status == "right"
    assert compare_pictures({}, far, right).status == "wrong"


def test_an_answer_that_is_always_the_same_earns_nothing():
    """Neither "no ray hits anything" nor any right number for all inputs; half of the hits earn half of the points."""
    hits = np.arange(100) % 4 == 0
    right = {"is_hit": hits.astype(np.int32), "distance": np.where(hits, 2.0 + np.arange(100), np.inf)}
    judge = Numbers(1e-4, "is_hit")
    assert judge({}, {"is_hit": np.zeros(100, np.int32), "distance": np.zeros(100)}, right).share == 0
    half = right["is_hit"] * (np.arange(100) < 50)
    assert judge({}, {**right, "is_hit": half}, right).share == pytest.approx(0.5, abs=0.03)
    assert judge({}, right, right).share == 1
