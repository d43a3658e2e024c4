"""The numbers of a study: intervals, the time to an error, what a knob changes, and what is claimed."""

import math

import numpy as np
import pytest

from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.studies import accuracy_report
from taichi_tracer.studies.study import Curve, Point, Study, change, crossing, error_after, interval
from taichi_tracer.studies.variants import Bench, SceneFacts, Shot, Variant


def test_an_interval_holds_the_true_value_in_95_of_100_studies():
    rng = np.random.default_rng(5)
    found = [interval(list(2 * rng.lognormal(0, 0.2, 3))) for _ in range(2000)]
    assert 0.93 < np.mean([one.low <= 2 <= one.high for one in found]) < 0.97  # four standard errors
    assert math.isnan(interval([1.0, math.inf]).value)
    assert interval([3.0]).high == math.inf


def test_the_time_to_an_error_lies_between_two_pictures():
    points = [Point(1, 1.0, 0.4), Point(4, 4.0, 0.2), Point(16, 16.0, 0.1), Point(64, 64.0, math.nan)]
    assert crossing(points, 0.2) == pytest.approx(4)
    assert crossing(points, 0.2 * 2**-0.5) == pytest.approx(8)
    assert crossing(points, 0.5) == 1
    assert crossing(points, 0.05) == math.inf
    assert crossing([*points, Point(256, 256.0, 0.3)], 0.2) == math.inf, "it has risen again"
    assert error_after(points, 2.0) == pytest.approx(0.4 * 2**-0.5)
    assert error_after(points, 64.0) == pytest.approx(0.05)


def curve(error, seconds=1.0, label="mis", **knobs):
    """A curve of three rounds, whose errors fall with the root of the samples."""
    points = [[Point(n, n * seconds, e * error * n**-0.5) for n in (1, 4, 16)] for e in (0.99, 1.0, 1.01)]
    image = np.full((8, 8, 3), 1.0)
    made = Curve(Variant(**knobs), label, "estimator" if label != "mis" else "", True, 1.5, rounds=points)
    made.finals = [(image, 0.0 * image)]
    return made


def study_of(curves, truth):
    """A study that is over."""
    study = Study(Bench("cube", size=(8, 8)), [], 60, 3)
    study.facts, study.curves, study.references = (
        SceneFacts("cube", "a machine", 0, True, 0.1),
        curves,
        {"nearest": truth},
    )
    study.start_seconds = study.compiling_seconds = 0.0
    return study


def test_a_knob_that_takes_twice_the_time_costs_twice_the_time():
    found = change(curve(1.0), curve(1.0, seconds=2.0))
    assert found.time.value == pytest.approx(2)
    assert found.error.value == pytest.approx(math.sqrt(2))
    assert found.verdict == "costs: × 2 the time to the same error"
    assert change(curve(1.0), curve(1.0)).verdict == "no clear difference"


@pytest.mark.parametrize(
    ("other", "words"),
    [(2.0, "mis is best: its error is 25 % after 16 s"), (1.001, "They differ by chance only.")],
)
def test_best_is_claimed_only_where_intervals_do_not_overlap(other, words):
    image = np.ones((8, 8, 3))
    truth = Shot(1.0, 64, image, RelativeError(0.001, 0.0009, 0.0011), 0 * image)
    study = study_of([curve(1.0), curve(other, label="brdf", estimator="brdf")], truth)
    assert words in accuracy_report.headline(study)[0]
    text, page = "\n".join(accuracy_report.as_text(study)), accuracy_report.as_html(study)
    assert "25 %" in text
    assert "25 %" in page
    assert "nan" not in text


def test_a_variant_is_below_what_can_be_judged_only_if_all_its_pictures_are():
    found = curve(1.0)
    found.rounds[0][-1] = Point(16, 16.0, math.nan)
    assert found.error.value == pytest.approx(found.levels()[-1][1], rel=1e-4)  # as the chart has it
    for points in found.rounds:
        points[-1] = Point(16, 16.0, math.nan)
    assert math.isnan(found.error.value)


def test_a_mean_that_differs_by_more_than_noise_is_said():
    image = np.ones((8, 8, 3))
    truth = Shot(1.0, 64, image, RelativeError(0.001, 0.0009, 0.0011), 0 * image)
    right, wrong = curve(1.0), curve(2.0, label="brdf", estimator="brdf")
    right.bias, wrong.shift, wrong.bias = 3.5, -0.019, -7.2
    (line,) = accuracy_report.biases_of(study_of([right, wrong], truth))
    assert line == "brdf is darker than the reference by 1.9 %, 7 standard errors: one of the two is wrong."
