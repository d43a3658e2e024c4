"""Marks: points, the rules of a course, and both as JSON."""

import json
import os
from datetime import datetime

import pytest
from teaching import sums

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, marks
from taichi_tracer.teaching.marks import Mark, PartMark, Rules, deductions, mark_of, read_rules
from taichi_tracer.teaching.submissions import submission

PARTS = (
    PartMark("A.f", "rays", 4.0, 1 / 3, "wrong", "no", {"input": {"x": float("nan")}}, ({"names": ["m"]},), 2.0),
    PartMark("A.g", "rays", 2.0, 1.0, "right", seconds=1.0),
)
MARK = Mark("1.zip", "1", PARTS, "", ("note",), ("camera.py imports 'os'",), (("late by 1 day", 10.0),), "limits", "hi")


@pytest.fixture(scope="module")
def assignment(tmp_path_factory):
    """A small assignment."""
    return catalogue.load(sums.write_assignment(tmp_path_factory.mktemp("marks") / "sums"))


def handed_in(tmp_path, name: str = "123456789.zip", time: str = "2026-11-20T12:00"):
    """A submission that was handed in at some time."""
    path = sums.zipped(tmp_path / name, {"sums.py": ""})
    moment = datetime.fromisoformat(time).timestamp()
    os.utime(path, (moment, moment))
    return submission(path)


def rules_of(tmp_path, assignment, values) -> Rules:
    """The rules of a file with these values."""
    (tmp_path / "rules.json").write_text(values if isinstance(values, str) else json.dumps(values))
    return read_rules(tmp_path / "rules.json", assignment)


def test_a_mark_adds_up():
    assert (MARK.points, MARK.earned, MARK.score, MARK.right, MARK.seconds) == (6.0, 3.33, 3.0, 1, 3.0)


def test_a_mark_survives_json():
    text = json.dumps(MARK.facts(), allow_nan=False)
    assert mark_of(json.loads(text)).facts() == json.loads(text)


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


def test_a_list_of_times_counts_more_than_the_file(tmp_path, assignment):
    values = {"due": "2026-11-20T12:00", "late_percent_per_day": 5, "handed_in": {"123456789": "2026-11-22T10:00"}}
    rules = rules_of(tmp_path, assignment, values)
    assert deductions(rules, handed_in(tmp_path), ()) == (("late by 2 days", 10.0),)


def test_names_and_imports(tmp_path):
    rules = Rules(misnamed_percent=5, import_percent=50)
    assert [percent for _, percent in deductions(rules, handed_in(tmp_path, "Ann.zip"), ("x",))] == [5, 50]
    assert deductions(Rules(), handed_in(tmp_path, "Ann.zip"), ("x",)) == ()


def test_points_of_the_course(tmp_path, assignment):
    rules = rules_of(tmp_path, assignment, {"points": {"Sums.add": 7.5}})
    assert rules.points_of(assignment) == sums.RIGHT | {"Sums.add": 7.5}
    assert rules_of(tmp_path, assignment, {}) == Rules()


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ("{", "no JSON"),
        ("[]", "has to be an object"),
        ({"late_percent": 1}, "did you mean 'late_percent_per_day'"),
        ({"points": {"Sums.ad": 1}}, "did you mean 'Sums.add'"),
        ({"points": {"Sums.add": -1}}, "a number of at least 0"),
        ({"points": {"Sums.add": True}}, "a number of at least 0"),
        ({"points": 3}, "an object"),
        ({"due": "tomorrow"}, "a time such as"),
        ({"imports": "os"}, "a list of names"),
        ({"late_days": "x"}, "a number of at least 0"),
    ],
)
def test_rules_that_cannot_be(values, told, tmp_path, assignment):
    with pytest.raises(InputError, match=told):
        rules_of(tmp_path, assignment, values)


def test_numbers_that_json_does_not_have():
    assert marks.plain({"a": (float("inf"), [float("nan")])}) == {"a": ["inf", ["nan"]]}
