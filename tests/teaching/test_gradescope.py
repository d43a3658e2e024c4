"""Gradescope: results.json against its documentation, and the upload, run as Gradescope runs it."""

import json
import subprocess
import zipfile

import pytest
from teaching import sums

from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import PartResult
from taichi_tracer.teaching.grading import gradescope
from taichi_tracer.teaching.grading.grade import Mark

VISIBILITY = ("hidden", "after_due_date", "after_published", "visible")
# Key → the type, or the values, that the documentation of Gradescope's autograders states.
OF_ALL = {
    "score": (int, float),
    "execution_time": (int, float),
    "output": str,
    "output_format": str,
    "visibility": VISIBILITY,
    "stdout_visibility": VISIBILITY,
    "extra_data": dict,
    "tests": list,
    "leaderboard": list,
}
OF_TESTS = {
    "score": (int, float),
    "max_score": (int, float),
    "status": ("passed", "failed"),
    "name": str,
    "name_format": str,
    "number": str,
    "output": str,
    "output_format": ("text", "html", "simple_format", "md", "ansi"),
    "tags": list,
    "visibility": VISIBILITY,
    "extra_data": dict,
}
EVIL = "\x1b</script><img src=x onerror=alert(1)> [x](javascript:alert(1)) **b**"
MARK = Mark(
    "1.zip",
    "1",
    (
        PartResult(
            "wrong", 0.25, "3 of 4", {"input": {"x": [1, 2]}, "yours": {"y": float("nan")}}, name="A.f", points=4.0
        ),
        PartResult(
            "right", 1.0, name="A.g", points=2.0, findings=({"names": ["m"], "text": "t", "hint": "h", "topic": "x"},)
        ),
        PartResult("crashed", 0.0, EVIL, name="A.h", points=1.0),
    ),
    "",
    ("note",),
    "printed",
)


def check_schema(values: dict, schema: dict) -> None:
    """Only keys that the documentation has, with values that it allows."""
    for key, value in values.items():
        allowed = schema[key]
        if isinstance(allowed, tuple) and isinstance(allowed[0], str):
            assert value in allowed
        else:
            assert isinstance(value, allowed)
            assert not isinstance(value, bool)


def check_results(text: str) -> dict:
    """A results.json as the documentation describes it."""
    values = json.loads(text, parse_constant=pytest.fail)
    check_schema(values, OF_ALL)
    assert "score" in values or values["tests"]
    for one in values["tests"]:
        check_schema(one, OF_TESTS)
        assert all(isinstance(tag, str) for tag in one["tags"])
        assert 0 <= one["score"] <= one["max_score"]
    return values


def test_results_follow_the_documentation():
    values = check_results(gradescope.results(MARK))
    assert values["score"] == MARK.score == 3.0
    assert [(one["name"], one["score"], one["status"]) for one in values["tests"]] == [
        ("A.f", 1.0, "failed"),
        ("A.g", 2.0, "passed"),
        ("A.h", 0.0, "failed"),
    ]


@pytest.fixture(scope="module")
def upload(tmp_path_factory):
    """The folder /autograder with the unpacked upload of a small assignment of one's own."""
    root = tmp_path_factory.mktemp("autograder")
    assignment = catalogue.load(sums.write_assignment(root / "sums"))
    path = gradescope.write_upload(assignment, str(assignment.folder), root / "upload.zip", 3)
    with zipfile.ZipFile(path) as archive:
        archive.extractall(root / "source")
    return root


def test_the_upload_has_what_gradescope_runs(upload):
    with zipfile.ZipFile(upload / "upload.zip") as archive:
        modes = {entry.filename: entry.external_attr >> 16 for entry in archive.infolist()}
    assert modes["setup.sh"] & 0o111
    assert modes["run_autograder"] & 0o111
    assert {"taichi_tracer/__init__.py", "assignment/sums/parts.py", "assignment/sums/solution/sums.py"} <= set(modes)
    assert any(name.startswith("taichi_tracer/scene_data_dir/cornell_box") for name in modes)
    assert not any("__pycache__" in name for name in modes)
    for script in ("setup.sh", "run_autograder"):
        assert subprocess.run(["bash", "-n", upload / "source" / script]).returncode == 0
        assert "--trust" in (upload / "source" / script).read_text()
    assert "taichi" in (upload / "source" / "setup.sh").read_text()
    assert "bubblewrap" in (upload / "source" / "setup.sh").read_text()
    assert (upload / "upload.zip").stat().st_size < 20e6
