"""The kit: a folder is handed out, checked and graded; right and wrong hand-ins get the marks that they deserve."""

import json
import zipfile
from pathlib import Path

import pytest
from acceptance.command import process

HAND_IN = Path(__file__).parents[1] / "course" / "handin"  # files of the course as a student writes them
ASSIGNMENTS = ("a1", "a2", "a3", "a4", "rt3", "rt3_lights")
# One mistake in a hand-in: file, right text, wrong text, and the only method that is then judged wrong.
MISTAKES = {
    "x is not normalised": (
        "camera.py",
        "self.up[None].cross(self.z[None]).normalized()",
        "self.up[None].cross(self.z[None])",
        "Camera.compute_matrix",
    ),
    "the corner of the pixel": ("camera.py", "tm.vec2(0.5, 0.5)", "tm.vec2(0.0, 0.0)", "Camera.generate_ndc_coords"),
    "normals exchanged": (
        "ray_intersector.py",
        "w * n0 + u * n1 + v * n2",
        "u * n0 + v * n1 + w * n2",
        "RayIntersector.intersect_triangle",
    ),
}


def taichi_tracer(folder, *words):
    """The command line in a process of its own."""
    return process("-m", "taichi_tracer", *words, folder=folder, TAICHI_TRACER_CACHE=str(folder / "cache"))


def zipped(folder: Path, number: int, mistake: str = "") -> None:
    """A hand-in of the course, with one mistake in it."""
    file, right, wrong, _ = MISTAKES.get(mistake, ("", "", "", ""))
    with zipfile.ZipFile(folder / f"{260123450 + number}.zip", "w") as archive:
        for path in sorted(HAND_IN.glob("*.py")):
            text = path.read_text()
            assert path.name != file or right in text, mistake
            archive.writestr(path.name, text.replace(right, wrong) if path.name == file else text)


def test_what_is_handed_out_is_not_solved(tmp_path):
    done = taichi_tracer(tmp_path, "assignment", "list")
    assert all(name in done.stdout for name in ASSIGNMENTS)
    assert taichi_tracer(tmp_path, "assignment", "new", "rt3", "mine").returncode == 0
    text = "".join(path.read_text() for path in (tmp_path / "mine").rglob("*.py"))
    assert "not_written(" in text
    done = taichi_tracer(tmp_path, "check", "mine")
    assert done.returncode == 1
    assert "not written" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a1", "rt3"])
def test_the_solution_is_right_everywhere(name, tmp_path):
    assert taichi_tracer(tmp_path, "assignment", "new", name, "solved", "--solution").returncode == 0
    done = taichi_tracer(tmp_path, "check", "solved")
    assert done.returncode == 0, done.stdout[-3000:]
    assert "wrong" not in done.stdout.lower().replace("nothing wrong", "")


@pytest.mark.slow
def test_marks_of_right_and_wrong_hand_ins(tmp_path):
    """The right one has all points; each mistake costs points in its own method, and no other method is wrong.

    Parts that are not handed in, such as the views, are missing.
    """
    folder = tmp_path / "class"
    folder.mkdir()
    names = ["", *MISTAKES]
    for number, mistake in enumerate(names):
        zipped(folder, number, mistake)
    done = taichi_tracer(tmp_path, "grade", "a1", "class", "--trust", "--json", "--jobs", "2")
    assert done.returncode == 0, done.stderr[-3000:]
    marks = json.loads(done.stdout)["submissions"]
    assert len(marks) == len(names)
    right = marks[0]["earned"] if marks[0]["key"].startswith("260123450") else None
    for mistake, mark in zip(names, sorted(marks, key=lambda mark: mark["key"]), strict=True):
        methods = {part["name"]: part["status"] for part in mark["parts"] if "." in part["name"]}
        wrong = {name for name, status in methods.items() if status in ("wrong", "crashed", "out of time")}
        assert wrong == ({MISTAKES[mistake][3]} if mistake else set()), mistake
        assert mark["earned"] == right if mistake == "" else 0 < mark["earned"] < right, mistake
