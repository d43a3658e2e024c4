"""Checking: what a student reads of each part, which known mistake is named, and how other errors are described."""

import math

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import PartResult
from taichi_tracer.teaching.checking import answers_of, changed_source, check_folder, describe, find
from taichi_tracer.teaching.handout.export import write_folder
from taichi_tracer.teaching.html_boxes import Report, lines_of
from taichi_tracer.teaching.running import expected


def test_the_points_of_a_report_are_the_sum_of_what_its_parts_show():
    """As in ``grade``: a student's page and the list of the class have the same number."""
    report = Report("a1", [PartResult("wrong", 0.916, points=1.0)] * 3)
    assert report.score() == report.points == pytest.approx(2.76)
    assert "2.76 of 3 points" in report.summary()
    assert "0.92 of 1" in lines_of(report.results[0])[0]


# ── descriptions ──


RNG = np.random.default_rng(4)
RIGHT = RNG.normal(size=(50, 3))


def told(yours, right=RIGHT):
    """The descriptions of one answer that is wrong everywhere."""
    return describe({"v": np.asarray(yours)}, {"v": np.asarray(right)}, np.zeros(len(right), bool))


@pytest.mark.parametrize(
    ("yours", "text"),
    [
        (RIGHT * [1, -1, 1], "v is mirrored: its y has the opposite sign"),
        (-RIGHT, "v points the opposite way"),
        (RIGHT[:, [1, 0, 2]], "v has its x and its y exchanged"),
        (2 * RIGHT, "v is scaled by 2"),
        (RIGHT / 4, "v is scaled by 1/4"),
        (math.pi * RIGHT, "v is scaled by π"),
        (RIGHT + [1, 0, 0.5], "v has a constant offset: 1, 0, 0.5"),
        (0 * RIGHT, "v is always 0"),
        (0 * RIGHT + 7, "v is the same for every input"),
        (1 - RIGHT, "v is 1 minus the right number"),
        (RIGHT + np.outer(RNG.normal(size=50), [0, 0, 1]), "v is right but for its z"),
        (np.full((50, 3), np.nan), "v is not a finite number in 50 of 50 cases"),
        (RIGHT[:, :2], "the answer 'v' has another shape than it should"),
    ],
)
def test_vectors(yours, text):
    assert told(yours) == [text]


def test_hits_that_are_missed():
    count = 40
    right = {"is_hit": np.ones(count, np.int32), "distance": np.linspace(1, 2, count)}
    missed = {**right, "is_hit": np.where(np.arange(count) < 5, 0, 1)}
    assert describe(missed, right, np.arange(count) >= 5) == ["5 hits are missed"]


# ── known mistakes ──


SEED = 1
MOST = 8  # mistakes of one method

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.mark.parametrize("part_name", ["Camera.generate_ndc_coords", "RayIntersector.query_ray"])
def test_every_mistake_is_found_under_its_own_name(part_name):
    assignment = catalogue.load("a1")
    part = assignment.part(part_name)
    right = expected(assignment, part, SEED)
    assert find(assignment, part, SEED, right, right) == []
    for one in (m for m in assignment.mistakes if m.part == part.name):
        wrong = answers_of(assignment, part, one, SEED)
        assert [finding["names"] for finding in find(assignment, part, SEED, wrong, right)] == [[one.name]]


@pytest.mark.parametrize("name", catalogue.names())
def test_a_method_has_few_known_mistakes_which_change_the_solution(name):
    assignment = catalogue.load(name)
    for part in assignment.parts:
        known = [m for m in assignment.mistakes if m.part == part.name]
        assert len({changed_source(assignment, part, one) for one in known}) == len(known) <= MOST


def test_an_error_that_no_mistake_explains_is_described():
    assignment = catalogue.load("a1")
    part = assignment.parts[0]
    right = expected(assignment, part, 0)
    found = find(assignment, part, 0, {"ndc": right["ndc"] * np.float32(0.7)}, right, seconds=0)
    assert [(f["names"], f["text"]) for f in found] == [([], "ndc is scaled by 0.7")]


# ── checking ──


pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.fixture
def solved(tmp_path):
    """A solved folder of assignment 1, to be changed."""
    write_folder(catalogue.load("a1"), tmp_path / "a1", is_solved=True)
    return tmp_path / "a1"


def change(folder, file, old, new):
    """Change one place of a student's file."""
    text = (folder / file).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (folder / file).write_text(text.replace(old, new), encoding="utf-8")


def test_a_wrong_number_stands_beside_the_right_one(solved):
    change(solved, "camera.py", "2 * (pixel_y + 0.5) / self.height - 1", "1 - 2 * (pixel_y + 0.5) / self.height")
    report = check_folder(solved, ["generate_ndc_coords", "generate_ray"])
    wrong, ray = report.results
    assert (wrong.status, ray.status) == ("wrong", "right")  # the ray is tested with the right NDC
    first = wrong.first_wrong
    assert first["yours"]["ndc"][1] == pytest.approx(-first["right"]["ndc"][1], rel=1e-5)
    assert "pixel" in first["input"]
    assert [finding["names"] for finding in wrong.findings] == [["y axis points down"]]
    assert 2 <= report.points < 2.2  # an odd number of rows has one in the middle
    text = str(report)
    assert "1 of 2 parts are right: 2" in text
    assert "hint: Where is pixel (0, 0)" in text
    assert "pixels agree with: y axis points down" in report.page()


def test_a_crash_has_its_line(solved):
    change(solved, "camera.py", "tan_half_fov = ti.tan(", "tan_half_fov = ti.tangent(")
    change(solved, "camera.py", "np.cross(z_c, x_c)", "np.crosss(z_c, x_c)")
    change(solved, "ray_intersector.py", "e2 = v2 - v0", "e2 = v2 - v9")
    lines = (solved / "camera.py").read_text(encoding="utf-8").splitlines()
    report = check_folder(solved, ["generate_camera_coords", "compute_matrix", "intersect_triangle", "query_ray"])
    coords, matrix, triangle, nearest = report.results
    assert (coords.status, matrix.status, triangle.status, nearest.status) == ("crashed", "crashed", "crashed", "right")
    assert f"camera.py:{1 + next(i for i, line in enumerate(lines) if 'tangent(' in line)}: " in coords.message
    assert f"camera.py:{1 + next(i for i, line in enumerate(lines) if 'crosss' in line)}: " in matrix.message
    assert "crosss" in matrix.message
    assert triangle.message.startswith("ray_intersector.py:")
    assert "v9" in triangle.message


def test_a_file_that_cannot_be_read_costs_its_own_parts_alone(solved):
    change(solved, "ray_intersector.py", "e1 = v1 - v0", "e1 = v1 - ")
    report = check_folder(solved, ["query_ray", "generate_ndc_coords", "picture: normal"])
    statuses = [result.status for result in report.results]
    assert statuses == ["crashed", "right", "crashed"]
    assert "SyntaxError: invalid syntax" in report.results[0].message


def test_missing_files_classes_and_methods(solved):
    (solved / "ray_intersector.py").unlink()
    change(solved, "camera.py", "def compute_matrix", "def compute_the_matrix")
    change(solved, "renderer.py", "class A1Renderer", "class Renderer")
    report = check_folder(solved, ["query_ray", "compute_matrix", "shade_hit"])
    assert [result.status for result in report.results] == ["missing"] * 3
    told = [result.message for result in report.results]
    assert told[0] == "the file ray_intersector.py is missing"
    assert told[1] == "Camera has no method compute_matrix"
    assert told[2] == "there is no class A1Renderer"


@ti.data_oriented
class MyCamera(tt.Camera):
    """As in a notebook: another name, and one method alone."""

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y):
        """The corner of the pixel."""
        return tm.vec2(2 * pixel_x / self.width - 1, 2 * pixel_y / self.height - 1)


def test_in_a_notebook_classes_are_given():
    report = tt.teaching.check("a1", MyCamera)
    by_name = {result.name: result for result in report.results}
    assert set(by_name) == {part.name for part in catalogue.load("a1").parts if part.replaces == "Camera"}
    ndc = by_name["Camera.generate_ndc_coords"]
    assert [finding["names"] for finding in ndc.findings] == [["pixel corner instead of centre"]]
    assert by_name["Camera.compute_matrix"].status == "missing"
    assert "pixel corner instead of centre" in report._repr_html_()
    assert tt.teaching.check("a1", MyCamera).points == report.points == 0  # twice: the function is still a function
