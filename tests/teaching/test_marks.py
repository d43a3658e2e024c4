"""Marks: points, the rules of a course, and both as JSON."""

import os
from datetime import datetime

import pytest
from teaching import sums

from taichi_tracer.teaching.marks import Mark, PartMark, Rules, deductions
from taichi_tracer.teaching.submissions import submission

PARTS = (
    PartMark("A.f", "rays", 4.0, 1 / 3, "wrong", "no", {"input": {"x": float("nan")}}, ({"names": ["m"]},), 2.0),
    PartMark("A.g", "rays", 2.0, 1.0, "right", seconds=1.0),
)
MARK = Mark("1.zip", "1", PARTS, "", ("note",), ("camera.py imports 'os'",), (("late by 1 day", 10.0),), "limits", "hi")


def handed_in(tmp_path, name: str = "123456789.zip", time: str = "2026-11-20T12:00"):
    """A submission that was handed in at some time."""
    path = sums.zipped(tmp_path / name, {"sums.py": ""})
    moment = datetime.fromisoformat(time).timestamp()
    os.utime(path, (moment, moment))
    return submission(path)


def test_a_mark_adds_up():
    assert (MARK.points, MARK.earned, MARK.score, MARK.right, MARK.seconds) == (6.0, 3.33, 3.0, 1, 3.0)


@pytest.mark.parametrize(
    ("time", "late", "percent"),
    [
        ("2026-11-20T11:59", None, 0),
        ("2026-11-20T12:00", None, 0),
        ("2026-11-20T12:01", "late by 1 day", 10),
        ("2026-11-21T12:00", "late by 1 day", 10),
        ("2026-11-21T12:01", "late by 2 days", 20),
        ("2026-11-24T12:00", "late by 4 days", 100),
    ],
)
def test_late_submissions(time, late, percent, tmp_path):
    rules = Rules(due=datetime(2026, 11, 20, 12), late_percent_per_day=10, late_days=3)
    assert deductions(rules, handed_in(tmp_path, time=time), ()) == (((late, percent),) if late else ())
