"""``taichi-tracer grade``: what it prints and writes, and how bad input is told; marks are made up here."""

import csv
import os

import pytest
from teaching import sums

from taichi_tracer.apps.cli import main
from taichi_tracer.apps.commands import grade as command
from taichi_tracer.teaching.base import PartResult
from taichi_tracer.teaching.grading import isolate
from taichi_tracer.teaching.grading.grade import Mark
from taichi_tracer.teaching.grading.isolate import best_level

PARTS = (
    PartResult("wrong", 0.5, "10 of 20", name="Sums.add", points=2.0),
    PartResult("right", 1.0, name="Sums.subtract", points=3.0),
)


@pytest.fixture
def assignment(tmp_path):
    """The folder of a small assignment."""
    return str(sums.write_assignment(tmp_path / "sums"))


@pytest.fixture
def classroom(tmp_path, monkeypatch):
    """A folder of two submissions, which get made-up marks."""

    def grade_class(assignment, found, settings, watch):
        marks = [Mark(one.key, one.student, PARTS, refused="=1+1") for one in found]
        for mark in marks if watch else ():
            watch(mark)
        return marks

    monkeypatch.setattr(command, "grade_class", grade_class)
    monkeypatch.setattr(command, "best_level", lambda trust, image: "limits" if trust else "bwrap")
    (tmp_path / "class").mkdir()
    for name in ("123456781", "123456782"):
        sums.zipped(tmp_path / "class" / f"{name}.zip", {"sums.py": sums.submission()})
    return str(tmp_path / "class")


def test_a_line_for_each_student_and_the_level(assignment, classroom, capsys):
    assert main(["grade", assignment, classroom]) == 0
    *lines, last = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["123456781", "123456782"]
    assert "4 of 5" in lines[0]
    assert last == "2 submissions, mean 4 of 5; isolation: bwrap"


@pytest.mark.skipif(os.name != "posix", reason="no submission can be run on Windows")
def test_without_bubblewrap_nothing_is_graded(assignment, classroom, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "best_level", best_level)
    monkeypatch.setattr(isolate, "problem_of", lambda level: "it is not installed" if level == "bwrap" else None)
    assert main(["grade", assignment, classroom]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    (line,) = told.err.splitlines()
    assert "it is not installed" in line
    assert "--trust" in line
    assert main(["grade", assignment, classroom, "--trust"]) == 0
    assert "isolation: limits" in capsys.readouterr().out


def test_csv_has_no_formulas(assignment, classroom, tmp_path):
    assert main(["grade", assignment, classroom, "--csv", str(tmp_path / "c.csv")]) == 0
    rows = list(csv.DictReader((tmp_path / "c.csv").open()))
    assert [(row["student"], row["score"], row["Sums.add"]) for row in rows] == [
        ("123456781", "4.0", "1.0"),
        ("123456782", "4.0", "1.0"),
    ]
    assert rows[0]["refused"] == "'=1+1"
