"""Marks: the points of the parts add up."""

from taichi_tracer.teaching.base import PartResult
from taichi_tracer.teaching.marks import Mark

PARTS = (
    PartResult("wrong", 1 / 3, name="A.f", points=4.0, seconds=2.0),
    PartResult("right", 1.0, name="A.g", points=2.0, seconds=1.0),
)
MARK = Mark("1.zip", "1", PARTS, "", ("note",), ("camera.py imports 'os'",), "limits", "hi")


def test_a_mark_adds_up():
    assert (MARK.points, MARK.score, MARK.right, MARK.seconds) == (6.0, 3.33, 1, 3.0)
