"""First mistakes of students in the folders of the assignments: each is one line with its file, its line and the cure.

A folder is the solution of an assignment in which one text was exchanged.
"""

import json
import re
import zipfile
from pathlib import Path

import pytest
from acceptance.command import process

import taichi_tracer as tt
from taichi_tracer.teaching.checking import check_folder

SOLUTIONS = Path(tt.__file__).parent / "teaching" / "assignments"
RETURN = "        return {}\n"
TO_WORLD = "self.camera_to_world[None] @ camera_coords"


def folder(path, assignment, *changes):
    """The solution of an assignment, with changes: (old, new)."""
    path.mkdir()
    for file in (SOLUTIONS / assignment / "solution").glob("*.py"):
        text = file.read_text(encoding="utf-8")
        for old, new in changes:
            text = text.replace(old, new)
        (path / file.name).write_text(text, encoding="utf-8")
    (path / "assignment.json").write_text(json.dumps({"assignment": assignment, "seed": 0}))
    return path


def wrong_parts(report):
    """Part → message, of those that are not right."""
    return {one.name: one.message for one in report.results if one.status != "right"}


NDC, RAY, COORDS = "Camera.generate_ndc_coords", "Camera.generate_ray", "Camera.generate_camera_coords"
TRIANGLE, MATRIX = "RayIntersector.intersect_triangle", "Camera.compute_matrix"
A1 = [  # the part, what was written instead of what, and what the message says
    (NDC, RETURN.format("ndc_coords"), "\n", "generate_ndc_coords has no return"),
    (COORDS, RETURN.format("camera_coords"), "        return\n", "generate_camera_coords has no return"),
    (RAY, RETURN.format("ray"), "        print(1)\n", "generate_ray has no return"),
    (MATRIX, RETURN.format("matrix"), "\n", "compute_matrix has no return"),
    (TRIANGLE, RETURN.format("hit"), "\n", "has no return"),
    (RAY, TO_WORLD, "self.camera_to_world @ camera_coords", "write self.camera_to_world[None]"),
    (RAY, TO_WORLD, "self.camera_to_world[None] * camera_coords", "use M @ v"),
    (RAY, "ray.origin = self.eye", "ray.origin = -self.x", "write self.x[None]"),
    (RAY, "ray.origin = self.eye", "ray.origin = tm.normalize(self.z)", "write self.z[None]"),
    (RAY, "ray.origin = self.eye", "ray.origin = np.array(self.eye)", "use self.eye[None]"),
    (RAY, "ray.origin = self.eye", "ray.origin = np.cross(self.eye, self.up)", "use tm.cross"),
    (RAY, "ray.origin =", "ray.o =", "write ray.origin"),
    (RAY, "def generate_ray(self, pixel_x", "def generate_ray(pixel_x", "generate_ray has no self"),
    (NDC, "def generate_ndc_coords(self, ", "def generate_ndc_coords(", "generate_ndc_coords has no self"),
    (TRIANGLE, "hit.distance =", "hit.t =", "write hit.distance"),
    (TRIANGLE, "hit.barycentric_coords =", "hit.uv =", "write hit.barycentric_coords"),
    (TRIANGLE, "hit.normal =", "hit.n =", "write hit.normal"),
    (TRIANGLE, "hit.material_id =", "hit.material =", "write hit.material_id"),
]


@pytest.mark.parametrize(("part", "old", "new", "says"), A1, ids=lambda value: str(value).strip()[:40])
def test_a_mistake_is_one_line_with_its_place_and_costs_its_own_part_alone(part, old, new, says, tmp_path):
    asked = [one[0] for one in A1] if part in (NDC, RAY) else [part, MATRIX]
    found = wrong_parts(check_folder(folder(tmp_path / "a1", "a1", (old, new)), sorted(set(asked))))
    assert set(found) <= {part, *([TRIANGLE, "RayIntersector.query_ray"] if part == TRIANGLE else [])}
    assert re.match(r"(camera|ray_intersector)\.py:\d+: ", found[part]), found
    assert says in found[part]
    assert "Held" not in found[part]


OTHERS = [
    ("a2", "UniformSampler.evaluate_probability", RETURN.format("probability"), "has no return"),
    ("a3", "MeshLightSampler.sample_emissive_triangle", RETURN.format("k"), "has no return"),
    ("a4", "A4Renderer.play_roulette", RETURN.format("probability"), "has no return"),
]


@pytest.mark.parametrize(("assignment", "part", "old", "says"), OTHERS[:1])
def test_a_return_that_lacks_in_other_assignments(assignment, part, old, says, tmp_path):
    found = wrong_parts(check_folder(folder(tmp_path / "f", assignment, (old, "\n")), [part]))
    assert says in found[part]


def test_a_picture_says_the_same(tmp_path):
    text = "import taichi as ti, taichi_tracer as tt\n\nclass Mine(tt.Camera):\n    @ti.func\n"
    text += (
        "    def generate_ray(self, pixel_x, pixel_y):\n        d = self.camera_to_world @ ti.math.vec4(0, 0, 1, 0)\n"
    )
    text += "        return tt.Ray(origin=self.eye, direction=d.xyz)\n\ntt.Camera.generate_ray = Mine.generate_ray\n"
    (tmp_path / "mine.py").write_text(text)
    words = ["render", "cube", "--view", "hit", "--size", "8x8", "--parts", "mine.py"]
    done = process("-m", "taichi_tracer", *words, folder=tmp_path)
    assert done.returncode == 2
    assert "mine.py:6: write self.camera_to_world[None]" in done.stderr


def test_one_syntax_error_is_said_once(tmp_path):
    report = check_folder(folder(tmp_path / "a1", "a1", ("matrix = np.eye(4)", "matrix = np.eye((4")))
    assert str(report).count("was never closed: matrix = np.eye((4") == 1
    assert report.page().count("was never closed") == 1
    assert len(wrong_parts(report)) > 4


@pytest.mark.slow
def test_grade_has_one_card_for_one_syntax_error(tmp_path):
    made = folder(tmp_path / "a1", "a1", ("matrix = np.eye(4)", "matrix = np.eye((4"))
    with zipfile.ZipFile(tmp_path / "260123456.zip", "w") as archive:
        for file in made.glob("*.py"):
            archive.write(file, file.name)
    words = ["grade", "a1", "260123456.zip", "--trust", "--report", "marks"]
    done = process("-m", "taichi_tracer", *words, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    (page,) = (tmp_path / "marks" / "students").glob("*.html")
    assert page.read_text(encoding="utf-8").count("was never closed") == 1


@pytest.mark.slow
def test_a2_writes_the_pictures_that_the_assignment_asks_for(tmp_path):
    made = folder(tmp_path / "a2", "a2", ("512, 512", "16, 16"))
    done = process("A2.py", folder=made, DISPLAY="")
    assert done.returncode == 0, done.stderr
    names = {file.stem.rpartition("_")[2] for file in made.rglob("*.png")}
    assert names == {"uniform", "brdf"}


BELOW = """import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Rough(tt.BRDF):
    name = "rough"

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return tm.vec3(ti.sqrt(tm.dot(n, w_i)) / tm.pi)
"""


@pytest.mark.slow
def test_check_part_names_the_direction_that_decides(tmp_path):
    (tmp_path / "rough.py").write_text(BELOW)
    done = process("-m", "taichi_tracer", "check-part", "rough.py", folder=tmp_path)
    said = done.stdout + done.stderr
    assert re.search(r"n·w_i = -\d.*, w_i = \[", said), said
