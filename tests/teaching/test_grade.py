"""Grading: marks of a class, whatever its submissions do; on a small assignment in plain Python."""

import os
from pathlib import Path

import numpy as np
import pytest
from teaching import sums

from taichi_tracer.teaching import catalogue, walls
from taichi_tracer.teaching import grade as grading
from taichi_tracer.teaching.grade import GradingSettings, grade_class
from taichi_tracer.teaching.sandbox import best_level
from taichi_tracer.teaching.submissions import find
from taichi_tracer.teaching.walls import Limits

LIMITS = Limits(cpu=3.0, wall=6.0, resident=2 << 30)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder, in which the cache of these tests is, too."""
    folder = tmp_path_factory.mktemp("grade")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TAICHI_TRACER_CACHE", str(folder / "cache"))
        yield folder


@pytest.fixture(scope="module")
def assignment(place):
    """The small assignment."""
    return catalogue.load(sums.write_assignment(place / "sums"))


@pytest.fixture(scope="module")
def level():
    """The strongest walls of this machine, or of the level that TAICHI_TRACER_LEVEL names."""
    with pytest.MonkeyPatch.context() as patch:
        if "TAICHI_TRACER_LEVEL" in os.environ:
            patch.setattr(walls, "LEVELS", (os.environ["TAICHI_TRACER_LEVEL"],))
        return best_level.__wrapped__(trust=True)


def handed_in(folder: Path, code: str, student: str = "123456789", **files: str):
    """A submission of one student as a zip file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = sums.zipped(folder / f"{student}.zip", {"sums.py": code, **files})
    return find(path, ["sums.py"])[0]


def earned(mark) -> dict[str, float]:
    """Part → points."""
    return {part.name: part.earned for part in mark.parts}


# ── a class ──

WRONG = sums.submission(add="return a - b")
HALF = sums.submission(add="import numpy as np\nreturn np.where(np.arange(20) < 10, a + b, 0)")
CRASHES = sums.submission(subtract="import os\nos._exit(3)")


@pytest.fixture(scope="module")
def classroom(place):
    """A folder with the submissions of six students."""
    folder = place / "class"
    codes = {"123456781": sums.submission(), "123456782": WRONG, "123456783": HALF, "123456784": CRASHES}
    for student, code in codes.items():
        handed_in(folder, code, student)
    sums.zipped(folder / "Ann.zip", {"a/sums.py": sums.submission(), "__MACOSX/._sums.py": "x"})
    sums.zipped(folder / "123456785.zip", {"../sums.py": sums.submission()})
    return folder


@pytest.fixture(scope="module")
def marks(assignment, classroom, level):
    """Their marks."""
    return grade_class(assignment, find(classroom, assignment.files), GradingSettings(level, LIMITS))


def points(marks) -> dict[str, dict[str, float]]:
    """Student → part → points."""
    return {mark.student: earned(mark) for mark in marks}


def test_what_a_stranger_says_cannot_change_a_terminal():
    assert grading.clean("a\x1b[2J\r\nb\u202e") == "a\N{REPLACEMENT CHARACTER}[2J" + "\N{REPLACEMENT CHARACTER}" * 2 + (
        "b\N{REPLACEMENT CHARACTER}"
    )
    assert len(grading.clean("x" * 1000)) == grading.LONGEST_MESSAGE
    assert len(grading.cut("x" * 10_000)) < 2100


@pytest.mark.parametrize(
    "answers",
    [
        {},
        {"value": np.zeros((2, 2))},
        {"value": np.full(20, np.nan)},
        {"value": np.zeros(20, bool)},
        {"value": np.array(1)},
        {"other": np.zeros(20)},
        {"value": np.zeros((0,) * 8)},
    ],
)
def test_any_answer_has_a_verdict(answers, assignment):
    part = assignment.parts[0]
    inputs = assignment.inputs(part, 1)
    verdict = grading.judged(part, inputs, answers, {"value": inputs["a"] + inputs["b"]})
    assert verdict.status in ("wrong", "crashed")
    assert verdict.share == 0
