"""What is told of a pixel: the tree of its steps, why a triangle was missed, text and JSON."""

import json
import math

import numpy as np
import pytest

from taichi_tracer.explain.explanation import Explanation, Step, grouped, steps_of, verdict_of
from taichi_tracer.explain.log import Entry


def noted(name, mark="", **values):
    return Entry(name, mark, tuple((key, 0) for key in values)), values


def tried(**values):
    return {"is_inside": 1, "det": 0.5, "u": 0.2, "v": 0.3, "t": 2.0, "taken": 2.0} | values


def test_steps_between_begin_and_end_are_within_the_step():
    steps = steps_of([noted("a"), noted("b", "begin", x=1), noted("c"), noted("b", "end", y=2), noted("d")])
    assert [s.name for s in steps] == ["a", "b", "d"]
    assert steps[1].values == {"x": 1, "y": 2}
    assert [s.name for s in steps[1].steps] == ["c"]
    assert [s.order for s in (steps[0], steps[1], steps[1].steps[0], steps[2])] == [0, 1, 2, 3]


def test_a_miss_has_no_other_numbers():
    steps = steps_of([noted("query_segment", "begin"), noted("query_segment", "end", is_hit=0, distance=math.inf)])
    assert steps[0].values == {"is_hit": 0}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (tried(is_inside=0, u=-0.1), "u < 0"),
        (tried(is_inside=0, u=0.8, v=0.5), "w < 0"),
        (tried(is_inside=0, u=-0.1, v=-0.2), "u and v < 0"),
        (tried(is_inside=0, det=0.0), "parallel"),
        (tried(taken=-1e-7), "not in front of the origin"),
        (tried(taken=-math.inf), "a side that it passes through"),
        (tried(taken=9.0), "farther than the nearest"),
        (tried(), "the nearest so far"),
    ],
)
def test_why_a_triangle_was_taken_or_not(values, words):
    assert words in verdict_of(values, 0.0, 5.0)[0]


def test_the_nearest_so_far_is_remembered_along_a_ray():
    hits = [noted("a triangle is tried", **tried(taken=t)) for t in (3.0, 4.0, 1.0)]
    steps = steps_of([noted("query_segment", "begin", t_min=0.0, t_max=math.inf), *hits, noted("query_segment", "end")])
    told = [step.verdict for step in steps[0].steps]
    assert [("nearest so far" in t, "farther" in t) for t in told] == [(True, False), (True, True), (True, False)]


def test_many_alike_are_told_by_their_number_but_hits_are_shown():
    steps = [Step("x", {"k": k}) for k in range(20)] + [Step("y")]
    steps[15].verdict = "hit at t = 1"
    shown = grouped(steps)
    assert [s.values["k"] for s in shown[:13]] == [*range(12), 15]
    assert [s.name for s in shown[13:]] == ["… 8 more like these", "y"]


def explanation(**more):
    zero = np.zeros(3)
    steps = [Step("query_segment", {"t_max": math.inf, "is_hit": 1.0, "triangle_id": 3.0})]
    return Explanation("A2Renderer", "mis", 3, 5, 3, 2, 0, 4, zero, zero, zero, steps, {}, **more)


def test_text_and_json_have_every_number():
    text = str(explanation())
    assert "column 3, row 5 from the top (x = 3, y = 2), sample 0" in text
    assert "t_max = ∞  is_hit = yes  triangle_id = 3" in text
    assert "1 ray traced" in text
    data = json.loads(explanation().to_json())
    assert data["steps"][0]["values"] == {"t_max": "inf", "is_hit": 1, "triangle_id": 3}


def test_what_is_missing_is_said():
    assert "the last ones are missing" in str(explanation(is_complete=False))
