"""What is told of a pixel, as text, JSON and HTML."""

import json
import math

import numpy as np

from taichi_tracer.explain.explanation import Explanation, Step, grouped


def test_many_alike_are_told_by_their_number_but_hits_are_shown():
    steps = [Step("x", {"k": k}) for k in range(20)] + [Step("y")]
    steps[15].verdict = "hit at t = 1"
    shown = grouped(steps)
    assert [s.values["k"] for s in shown[:13]] == [*range(12), 15]
    assert [s.name for s in shown[13:]] == ["… 7 more like these", "y"]


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
