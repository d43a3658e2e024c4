"""A class on a cluster: what cannot be sent, the rules of a course, and what is kept; its workers are made up here."""

import io
import json
import zipfile
from types import SimpleNamespace

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.cluster import grading
from taichi_tracer.teaching import catalogue, submissions
from taichi_tracer.teaching.grade import GradingSettings
from taichi_tracer.teaching.marks import Mark, PartMark, Rules, read_rules

NAMES = "123456781", "123456782"


class Sweep:
    """Workers that give every submission half of the points."""

    jobs = 0

    def __init__(self, _cluster, submit, count):
        self.submit, self.count = submit, count

    def run(self, came):
        buffer = io.BytesIO()
        np.savez(buffer, **{"picture/yours": np.zeros((2, 2, 3), np.float16)})
        for job in reversed(range(self.count)):
            Sweep.jobs += 1
            name = self.submit(job, SimpleNamespace(address="tcp://a:1"))
            parts = tuple(PartMark(p.name, p.topic, p.points, 0.5, "wrong") for p in catalogue.load("rt3").parts)
            facts = json.loads(json.dumps(Mark(name, name.removesuffix(".zip"), parts, level="bwrap").facts()))
            came(job, {"facts": facts, "pictures": buffer.getvalue()})


class Cluster:
    """A cluster that only passes the name of what is sent."""

    session = "one"

    def prepare(self, *settings):
        self.settings = settings

    def submit(self, _function, _session, _assignment, name, content, *_words, at):
        assert content[:2] == b"PK"
        return name


@pytest.fixture
def found(tmp_path, monkeypatch):
    """Two submissions; workers and kept marks are the test's."""
    monkeypatch.setattr(grading, "Sweep", Sweep)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(Sweep, "jobs", 0)
    for name in NAMES:
        with zipfile.ZipFile(tmp_path / f"{name}.zip", "w") as archive:
            archive.writestr("camera.py", "")
    return submissions.find(tmp_path, catalogue.load("rt3").files)[-2:]


def graded(found, rules=None, watch=None, trust=False, **settings):
    made = GradingSettings(grading.level_of(trust), **settings)
    return grading.grade_class(Cluster(), catalogue.load("rt3"), found, rules or Rules(), made, watch)


def test_marks_come_in_the_order_of_the_class_with_the_rules_of_the_course(found, tmp_path):
    weights = tmp_path / "weights.json"
    weights.write_text(json.dumps({"points": {"PerspectiveCamera.generate_ray": 40}}))
    seen = []
    marks = graded(found, read_rules(weights, catalogue.load("rt3")), lambda mark: seen.append(mark.student))
    assert [mark.student for mark in marks] == list(NAMES)
    assert seen == list(reversed(NAMES))  # as they came
    usual = sum(part.points for part in catalogue.load("rt3").parts)
    assert marks[0].points == usual + 37
    assert marks[0].score == pytest.approx(marks[0].points / 2)
    assert marks[0].level == "bwrap"


def test_what_was_graded_is_kept_here_without_the_rules(found):
    first = graded(found)
    jobs = Sweep.jobs
    again = graded(found, Rules(points={"PerspectiveCamera.generate_ray": 40.0}))
    assert Sweep.jobs == jobs
    assert again[0].points == first[0].points + 37
    graded(found, anew=True)
    assert Sweep.jobs == 2 * jobs


def test_code_of_the_caller_and_folders_are_not_sent(tmp_path):
    with pytest.raises(tt.InputError, match="to which no assignment of your own is sent"):
        grading.check("my_assignment", [])
    (tmp_path / "123456789").mkdir()
    with pytest.raises(tt.InputError, match="a cluster grades zip files, and this is a folder"):
        grading.check("rt3", [submissions.submission(tmp_path / "123456789")])


def test_walls_of_workers_are_theirs():
    assert grading.level_of(trust=False).name == "bwrap"
    assert "worker" in str(grading.level_of(trust=True))


@pytest.mark.parametrize("trust", [False, True])
def test_workers_are_told_whether_limits_are_enough(trust, found, monkeypatch):
    sent = []
    monkeypatch.setattr(Cluster, "submit", lambda _self, *words, at: sent.append(words[-1]) or words[3])
    graded(found, trust=trust)
    assert sent == [trust, trust]
