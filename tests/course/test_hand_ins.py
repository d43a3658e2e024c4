"""Hand-ins of the course: whole files with relative imports, as students write them, graded as they are."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.course import adapters, files
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import RIGHT
from taichi_tracer.teaching.grading.grade import GradingSettings, Reference, grade
from taichi_tracer.teaching.grading.isolate import Limits
from taichi_tracer.teaching.grading.submissions import find
from taichi_tracer.teaching.running import OPTIONAL_TEXT

HAND_IN = Path(__file__).parent / "handin"
SIZE = 24
VIEW = {"eye": (0, 1, 3), "at": (0, 1, 0)}


def hand_in(folder: Path, changes: dict[str, list[tuple[str, str]]], around: str = "") -> Path:
    """A zip file, named by a student's number, with the files of ``HAND_IN`` after some changes."""
    path = folder / "260123456.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for file in sorted(HAND_IN.glob("*.py")):
            text = file.read_text(encoding="utf-8")
            for old, new in changes.get(file.name, []):
                assert old in text, (file.name, old)
                text = text.replace(old, new)
            archive.writestr(f"{around}{file.name}", text)
    return path


def marks(path: Path, name: str) -> dict:
    """Part → its mark, of those that are judged, or optional."""
    assignment = catalogue.load(name)
    (submitted,) = find(path, assignment.files)
    found = grade(Reference(assignment, 1), submitted, GradingSettings("limits", Limits()))
    assert found.refused == ""
    return {part.name: part for part in found.parts if part.points > 0 or part.message == OPTIONAL_TEXT}


# ── what only graduate students hand in


def test_a_file_that_cannot_be_run_leaves_the_others(tmp_path):
    found = marks(hand_in(tmp_path, {"camera.py": [("import Ray", "import Raay")]}), "a1")
    assert "camera.py:5: ImportError" in found["Camera.generate_ray"].message
    assert found["RayIntersector.intersect_triangle"].status == RIGHT


# ── the same files in the package's own pictures


@pytest.fixture(scope="module")
def student(f32):
    found = files.load(HAND_IN)
    assert found.errors == {}
    return adapters.adapters_of(found.classes)


@pytest.mark.parametrize("view", tt.A1Renderer.names())
def test_views_by_a_students_camera_and_intersector_are_the_packages(view, student):
    own = tt.load_scene_data("cornell_box")
    theirs = tt.load_scene_data("cornell_box", intersector=student["RayIntersector"])
    expected = tt.A1Renderer(own, SIZE, SIZE, camera=tt.Camera(SIZE, SIZE, **VIEW)).use(view).image()
    found = tt.A1Renderer(theirs, SIZE, SIZE, camera=student["Camera"](SIZE, SIZE, **VIEW)).use(view).image()
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_a_class_without_some_methods_has_the_packages(student):
    """However often one is taken away, and if it is the only one."""
    environment = adapters.without(student["Environment"], "query_ray")
    assert environment.query_ray is tt.Environment.query_ray
    camera = adapters.without(adapters.without(student["Camera"], "generate_ray"), "compute_matrix")
    assert (camera.generate_ray, camera.compute_matrix) == (tt.Camera.generate_ray, tt.Camera.compute_matrix)
    assert camera.generate_ndc_coords is student["Camera"].generate_ndc_coords
