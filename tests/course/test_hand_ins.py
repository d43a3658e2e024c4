"""Hand-ins of the course: whole files with relative imports, as students write them, graded as they are."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.course import borders, files
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import MISSING, RIGHT
from taichi_tracer.teaching.grade import GradingSettings, grade
from taichi_tracer.teaching.reference import Reference
from taichi_tracer.teaching.running import OPTIONAL_TEXT
from taichi_tracer.teaching.sandbox import WallLevel
from taichi_tracer.teaching.stubs import is_placeholder
from taichi_tracer.teaching.submissions import find
from taichi_tracer.teaching.walls import Limits

HAND_IN = Path(__file__).parent / "handin"
SIZE = 24
VIEW = {"eye": (0, 1, 3), "at": (0, 1, 0)}

HALF_TAN = "@ti.func\ndef half_tan(fov):\n    return ti.tan(fov * tm.pi / 360)\n\n\n"

# Styles in which students write the same: file → (old, new) texts.
STYLES: dict[str, dict[str, list[tuple[str, str]]]] = {
    "as it is": {},
    "numpy for the matrix, and one line": {
        "camera.py": [
            ("    @ti.kernel\n    def compute_matrix(self):\n        # TODO\n", "    def compute_matrix(self):\n"),
            ("tm.mat4([x.x,", "ti.Matrix([[x.x,"),
            ("[0, 0, 0, 1])", "[0, 0, 0, 1]])"),
        ],
        "ray_intersector.py": [
            ("if 0 <= u <= 1 and v >= 0 and u + v <= 1", "if u >= 0 and v >= 0 and (1 - u - v) >= 0")
        ],
    },
    "attributes of the constructor": {
        "camera.py": [
            ("        self.height = height\n", "        self.height = height\n        self.ratio = width / height\n"),
            ("(self.width / self.height)", "self.ratio"),
        ],
        "renderer.py": [
            ("        self.RAY_OFFSET = 1e-6\n", "        self.RAY_OFFSET = 1e-6\n        self.brdf = BRDF()\n"),
            ("w_i = BRDF.sample_direction(material, w_o, n)", "w_i = self.brdf.sample_direction(material, w_o, n)"),
        ],
    },
    "helpers, and imports from the package": {
        "camera.py": [
            ("from .ray import Ray", "from taichi_tracer.ray import Ray"),
            ("        t = tm.tan(tm.radians(self.fov[None]) / 2)\n", "        t = half_tan(self.fov[None])\n"),
            (
                "@ti.data_oriented\nclass Camera",
                HALF_TAN + "@ti.data_oriented\nclass Camera",
            ),
        ],
        "ray_intersector.py": [("e1.dot(p)", "tm.dot(e1, p)"), ("is_back = det < 0", "is_back = bool(det < 0)")],
    },
}


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


def marks(path: Path, name: str, finds: bool = False) -> dict:
    """Part → its mark, of those that are judged, or optional."""
    assignment = catalogue.load(name)
    with Reference(assignment, 1) as reference:
        (submitted,) = find(path, assignment.files)
        found, _ = grade(reference, submitted, GradingSettings(WallLevel("limits"), Limits(), finds=finds))
    assert found.refused == ""
    assert found.imports == ()
    return {part.name: part for part in found.parts if part.points > 0 or part.message == OPTIONAL_TEXT}


# ── what only graduate students hand in

MARK = "    # 546 part\n"  # stands before it in the files
BASE_CODE = {
    "a2": """
    @staticmethod
    @ti.func
    def sample_direction(material: Material, w_o: tm.vec3, normal: tm.vec3) -> tm.vec3:
        # 546 only
        return tm.vec3(0.)

    @staticmethod
    @ti.func
    def evaluate_probability(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> float:
        return 1.

    @staticmethod
    @ti.func
    def evaluate_brdf(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> tm.vec3:
        pass

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> tm.vec3:
        pass
""",
    "a3": """
    @ti.kernel
    def precompute_envmap(self):
        self.precompute_scalar()
        self.precompute_cdfs()

    @ti.func
    def precompute_scalar(self):
        # 546 only
        pass

    @ti.func
    def precompute_cdfs(self):
        pass

    @ti.func
    def sample_theta(self, u1: float) -> int:
        return 0

    @ti.func
    def importance_sample_envmap(self) -> tm.vec2:
        u1 = ti.random()
        sampled_theta = self.sample_theta(u1)
        return tm.vec2([0., 0.])
""",
}
HOMES = {"a2": "sampler.py", "a3": "environment.py"}


def base_code(name: str) -> dict[str, list[tuple[str, str]]]:
    """The changes that leave only the base code of the graduate part of an assignment."""
    text = (HAND_IN / HOMES[name]).read_text(encoding="utf-8")
    return {HOMES[name]: [(text[text.index(MARK) :], BASE_CODE[name])]}


def without(name: str) -> dict[str, list[tuple[str, str]]]:
    """The changes that leave nothing of it."""
    return {file: [(old, "    pass\n")] for file, ((old, _),) in base_code(name).items()}


@pytest.mark.parametrize(
    ("body", "is_empty"),
    [
        ("pass", True),
        ("return 0.5", True),
        ("self.cdf[0] = u", False),
        ("return self.other()", True),
        ("return u", False),
    ],
)
def test_a_method_of_the_base_code_is_known_by_what_it_reads(body, is_empty):
    space = {}
    text = f"class Student:\n    def asked(self, u):\n        {body}\n    def other(self):\n        pass\n"
    exec(text, space)
    assert is_placeholder(space["Student"], "asked") == is_empty


def test_a_method_that_is_missing_is_one_line(tmp_path):
    path = hand_in(tmp_path, {"camera.py": [("def generate_ndc_coords", "def generate_ndc")]})
    part = marks(path, "a1")["Camera.generate_ndc_coords"]
    assert (part.status, part.message) == (MISSING, "Camera has no method generate_ndc_coords")


def test_a_file_that_cannot_be_run_leaves_the_others(tmp_path):
    found = marks(hand_in(tmp_path, {"camera.py": [("import Ray", "import Raay")]}), "a1")
    assert "camera.py:5: ImportError" in found["Camera.generate_ray"].message
    assert found["RayIntersector.intersect_triangle"].status == RIGHT


# ── the same files in the package's own pictures


@pytest.fixture(scope="module")
def student(f32):
    found = files.load(HAND_IN)
    assert found.errors == {}
    return borders.borders_of(found.classes)


@pytest.mark.parametrize("view", tt.A1Renderer.names())
def test_views_by_a_students_camera_and_intersector_are_the_packages(view, student):
    own = tt.load_scene_data("cornell_box")
    theirs = tt.load_scene_data("cornell_box", intersector=student["RayIntersector"])
    expected = tt.A1Renderer(own, SIZE, SIZE, camera=tt.Camera(SIZE, SIZE, **VIEW)).use(view).image()
    found = tt.A1Renderer(theirs, SIZE, SIZE, camera=student["Camera"](SIZE, SIZE, **VIEW)).use(view).image()
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_what_is_no_file_of_the_course_is_not_taken_for_one(tmp_path):
    assert files.is_of_course(HAND_IN, ["camera.py"])
    solution = catalogue.load("a1").solution_folder
    assert not files.is_of_course(solution, ["camera.py", "ray_intersector.py", "renderer.py"])
    with pytest.raises(tt.InputError, match="none of camera.py"):
        files.find_folder(tmp_path)
