"""Marks: the points of the parts add up."""

from taichi_tracer.teaching.marks import Mark, PartMark

PARTS = (
    PartMark("A.f", "rays", 4.0, 1 / 3, "wrong", "no", {"input": {"x": float("nan")}}, ({"names": ["m"]},), 2.0),
    PartMark("A.g", "rays", 2.0, 1.0, "right", seconds=1.0),
)
MARK = Mark("1.zip", "1", PARTS, "", ("note",), ("camera.py imports 'os'",), "limits", "hi")


def test_a_mark_adds_up():
    assert (MARK.points, MARK.score, MARK.right, MARK.seconds) == (6.0, 3.33, 1, 3.0)
