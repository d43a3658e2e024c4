"""Judges: rounding is right, a wrong number is wrong, and right samples hardly ever fail."""

import numpy as np
import pytest

from taichi_tracer.teaching.judges import Numbers, Pictures, Samples, statistics

RNG = np.random.default_rng(7)


def test_numbers_agree_up_to_rounding():
    right = {"x": np.array([1.0, 1e4, 0.0])}
    yours = {"x": np.array([1.00005, 1e4 + 0.5, 0.00005])}
    assert Numbers(1e-4).agrees({}, yours, right).all()
    assert not Numbers(1e-6).agrees({}, yours, right).any()


def test_a_missing_or_misshapen_answer_is_wrong():
    right = {"x": np.zeros((3, 2))}
    assert not Numbers().agrees({}, {}, right).any()
    assert not Numbers().agrees({}, {"x": np.zeros(3)}, right).any()


def test_of_a_miss_only_the_miss_counts():
    right = {"is_hit": np.array([1, 0]), "distance": np.array([2.0, np.inf])}
    judge = Numbers(1e-4, "is_hit")
    assert judge.agrees({}, {"is_hit": np.array([1, 0]), "distance": np.array([2.0, 5.0])}, right).all()
    assert (
        judge.agrees({}, {"is_hit": np.array([1, 1]), "distance": np.array([3.0, 5.0])}, right).tolist() == [False] * 2
    )


def test_the_first_wrong_number_is_told_with_its_input():
    right, yours = {"x": np.array([1.0, 2.0, 3.0])}, {"x": np.array([1.0, 2.5, 3.0])}
    verdict = Numbers(called="pixels")({"pixel": np.array([10, 11, 12]), "width": np.array(4)}, yours, right)
    assert (verdict.status, verdict.message) == ("wrong", "1 of 3 pixels are wrong")
    assert verdict.share == pytest.approx(1 / 2)  # one of three would be right by chance
    assert verdict.first_wrong == {"input": {"pixel": 11, "width": 4}, "yours": {"x": 2.5}, "right": {"x": 2.0}}


def test_nan_and_infinity_are_wrong_unless_they_are_right():
    right = {"x": np.array([1.0, np.inf, np.inf, np.inf])}
    yours = {"x": np.array([np.nan, np.inf, 5, -np.inf])}
    assert Numbers().agrees({}, yours, right).tolist() == [False, True, False, False]


def test_right_samples_hardly_ever_fail():
    """Of 600 answers with right samples, none fails one of its tests, and z is distributed normally."""
    largest = []
    for _ in range(600):
        yours, right = (statistics(RNG.uniform(0, 1, (1, 1024, 2))) for _ in range(2))
        largest.append(np.abs(Samples().scores({"x": yours}, {"x": right})["x"]).max())
    assert max(largest) < 5.5
    assert 1.0 < np.median(largest) < 1.6


def test_wrong_samples_fail():
    right = statistics(RNG.uniform(0, 1, (3, 4096, 2)))
    for wrong in (RNG.uniform(0, 1.1, (3, 4096, 2)), np.repeat(RNG.uniform(0, 1, (3, 4096, 1)), 2, axis=2)):
        assert not Samples().agrees({}, {"x": statistics(wrong)}, {"x": right}).any()


def test_samples_that_are_not_finite_fail():
    samples = RNG.uniform(0, 1, (2, 512, 3))
    right = statistics(samples)
    samples[0, 0, 0] = np.nan
    assert Samples().agrees({}, {"x": statistics(samples)}, {"x": right}).tolist() == [False, True]


def test_the_report_shows_means_and_deviations():
    samples = RNG.normal(3, 2, (2, 4096, 3))
    told = Samples().told({"x": statistics(samples)})
    assert np.allclose(told["mean x"], 3, atol=0.2)
    assert np.allclose(told["deviation of x"], 2, atol=0.2)


def test_a_picture_may_differ_at_a_few_edges():
    right = {"picture": RNG.uniform(0, 1, (20, 30, 3))}
    few, many = right["picture"].copy(), right["picture"].copy()
    few[0, :5] = 9
    many[:10] = 9
    assert Pictures()({}, {"picture": few}, right).status == "right"
    verdict = Pictures()({}, {"picture": many}, right)
    assert (verdict.status, verdict.share) == ("wrong", pytest.approx(0.5, abs=2e-3))
    assert set(verdict.pictures) == {"yours", "right", "difference"}


def test_a_random_picture_may_differ_by_its_error():
    right = {"picture": np.full((8, 8, 3), 1.0), "error": np.full((8, 8, 3), 0.1)}
    near = {"picture": np.full((8, 8, 3), 1.3), "error": np.full((8, 8, 3), 0.1)}
    far = {"picture": np.full((8, 8, 3), 3.0), "error": np.full((8, 8, 3), 0.1)}
    assert Pictures()({}, near, right).status == "right"
    assert Pictures()({}, far, right).status == "wrong"


def test_an_answer_that_is_always_the_same_earns_nothing():
    """Neither "no ray hits anything" nor any right number for all inputs; half of the hits earn half of the points."""
    hits = np.arange(100) % 4 == 0
    right = {"is_hit": hits.astype(np.int32), "distance": np.where(hits, 2.0 + np.arange(100), np.inf)}
    judge = Numbers(1e-4, "is_hit")
    assert judge({}, {"is_hit": np.zeros(100, np.int32), "distance": np.zeros(100)}, right).share == 0
    half = right["is_hit"] * (np.arange(100) < 50)
    assert judge({}, {**right, "is_hit": half}, right).share == pytest.approx(0.5, abs=0.03)
    assert judge({}, right, right).share == 1


def test_a_picture_of_one_colour_earns_nothing():
    right = {"picture": np.zeros((10, 10, 3))}
    right["picture"][:3] = 1
    assert Pictures()({}, {"picture": np.zeros((10, 10, 3))}, right).share == 0


def test_noise_is_no_answer():
    """Samples of a huge variance have the right mean within their own error; that is not enough."""
    right = {"x": statistics(RNG.uniform(0, 1, (8, 4096, 2)))}
    noise = {"x": statistics((1 - RNG.random((8, 4096, 2))) ** -3.0 * RNG.choice([-1, 1], (8, 4096, 2)))}
    for only_means in (False, True):
        verdict = Samples(only_means=only_means)({}, noise, right)
        assert (verdict.status, verdict.share) == ("wrong", 0)


def test_right_means_with_another_distribution_earn_a_share():
    rng = np.random.default_rng(3)
    right = {"x": statistics(rng.choice([0.0, 2.0], (3, 10_000, 1)))}
    other = {"x": statistics(rng.uniform(0, 2, (3, 10_000, 1)))}
    wrong = {"x": statistics(rng.uniform(0, 1, (3, 10_000, 1)))}
    judge = Samples(for_means=0.8)
    assert (judge({}, other, right).status, judge({}, other, right).share) == ("wrong", 0.8)
    assert judge({}, other, right).message.endswith("their means are right")
    assert judge({}, wrong, right).share == 0
    assert Samples()({}, other, right).share == 0
