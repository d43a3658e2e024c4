"""What was noted becomes a tree of steps, which says of every triangle why it was taken or missed."""

import math

import pytest

from taichi_tracer.explain.log import Entry
from taichi_tracer.explain.steps import steps_of, verdict_of


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
