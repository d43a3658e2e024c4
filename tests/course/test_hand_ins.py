"""Hand-ins of the course: whole files with relative imports, as students write them, graded as they are."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from support import long_except

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
# Real mistakes: (file, old, new, the only part that is wrong)
MISTAKES = {
    "x not normalised": (
        *("camera.py", "self.up[None].cross(self.z[None]).normalized()", "self.up[None].cross(self.z[None])"),
        "Camera.compute_matrix",
    ),
    "corner of the pixel": ("camera.py", "tm.vec2(0.5, 0.5)", "tm.vec2(0.0, 0.0)", "Camera.generate_ndc_coords"),
    "degrees": ("camera.py", "tm.radians(self.fov[None])", "self.fov[None]", "Camera.generate_camera_coords"),
    "weights exchanged": (
        *("ray_intersector.py", "w * n0 + u * n1 + v * n2", "u * n0 + v * n1 + w * n2"),
        "RayIntersector.intersect_triangle",
    ),
    "normal turned at the front": (
        *(
            "ray_intersector.py",
            "if is_back:\n                    normal",
            "if not is_back:\n                    normal",
        ),
        "RayIntersector.intersect_triangle",
    ),
    "ids from 0": (
        "ray_intersector.py",
        "hit_data.triangle_id = triangle_id",
        "hit_data.triangle_id = triangle_id - 1",
        "RayIntersector.intersect_triangle",
    ),
    "nothing returned": (
        *("camera.py", "        return tm.vec4(ndc_coords.x * t", "        a = tm.vec4(ndc_coords.x * t"),
        "Camera.generate_camera_coords",
    ),
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


@pytest.mark.long
@pytest.mark.parametrize("around", long_except(["", "taichi_tracer/", "A1_codebase/taichi_tracer/"], "taichi_tracer/"))
def test_a_hand_in_is_found_wherever_the_zip_has_it(around, tmp_path):
    found = marks(hand_in(tmp_path, {}, around), "a1")
    assert {part.status for part in found.values()} == {RIGHT}
    assert sum(part.points for part in found.values()) == 20


@pytest.mark.long
@pytest.mark.parametrize("style", list(STYLES)[1:])
def test_right_ones_in_other_styles_get_all_points(style, tmp_path):
    found = marks(hand_in(tmp_path, STYLES[style]), "a1")
    assert {name: part.message for name, part in found.items() if part.status != RIGHT} == {}


@pytest.mark.long
def test_a_renderer_may_use_what_its_constructor_makes(tmp_path):
    found = marks(hand_in(tmp_path, STYLES["attributes of the constructor"]), "a2")
    assert {name: part.message for name, part in found.items() if part.status != RIGHT} == {}


@pytest.mark.long
@pytest.mark.parametrize("name", ["a2", "a3", "a4"])
def test_the_later_assignments_get_all_points(name, tmp_path):
    found = marks(hand_in(tmp_path, {}), name)
    assert len(found) >= 2
    assert {part: mark.message for part, mark in found.items() if mark.status != RIGHT} == {}


@pytest.mark.long
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_real_mistake_costs_its_own_part(mistake, tmp_path):
    file, old, new, wrong = MISTAKES[mistake]
    found = marks(hand_in(tmp_path, {file: [(old, new)]}), "a1")
    methods = {name for name, part in found.items() if part.status != RIGHT and not name.startswith("picture")}
    assert methods == {wrong}


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
OPTIONAL = {name: sorted(catalogue.load(name).optional) for name in HOMES}
SIN_OF_ROW = " * sin_theta"
GRADUATE_MISTAKES = {
    "printed density": (
        *("a2", "material, o)) / (4. * o.z)", "material, M @ w_i)) / (4. * (M @ w_i).z)"),
        *("MicrofacetBRDF.evaluate_probability", "ω_i in place of ω_o"),
    ),
    "separable": (
        *("a2", "(1. + MicrofacetBRDF.Lambda(material, o) + MicrofacetBRDF.Lambda(material, i))"),
        "((1. + MicrofacetBRDF.Lambda(material, o)) * (1. + MicrofacetBRDF.Lambda(material, i)))",
        *("MicrofacetBRDF.evaluate_brdf", "separable G"),
    ),
    "half vector returned": ("a2", "M @ reflect(o, h)", "M @ h", "MicrofacetBRDF.sample_direction", ""),
    "sin forgotten": ("a3", SIN_OF_ROW, "", "Environment.precompute_scalar", "sin θ forgotten"),
    "cdf off by one": (*("a3", "t, t + 1) / float", "t - 1, t) / float", "Environment.importance_sample_envmap", ""),),
    "rows upside down": (
        *("a3", "tm.vec2([u, v])", "tm.vec2([u, 1 - v])"),
        *("Environment.importance_sample_envmap", "rows upside down"),
    ),
    "rows not weighted": (
        *("a3", "self.p_theta[y] += self.image_scalar[x, y]", "self.p_theta[y] += 1.0"),
        *("Environment.importance_sample_envmap", ""),
    ),
}


def base_code(name: str) -> dict[str, list[tuple[str, str]]]:
    """The changes that leave only the base code of the graduate part of an assignment."""
    text = (HAND_IN / HOMES[name]).read_text(encoding="utf-8")
    return {HOMES[name]: [(text[text.index(MARK) :], BASE_CODE[name])]}


def without(name: str) -> dict[str, list[tuple[str, str]]]:
    """The changes that leave nothing of it."""
    return {file: [(old, "    pass\n")] for file, ((old, _),) in base_code(name).items()}


@pytest.mark.long
@pytest.mark.parametrize("name", BASE_CODE)
@pytest.mark.parametrize("rest", [base_code, without])
def test_a_hand_in_without_the_graduate_part_loses_nothing(name, rest, tmp_path):
    found = marks(hand_in(tmp_path, rest(name)), name)
    told = {part: (mark.points, mark.status, mark.message) for part, mark in found.items() if part in OPTIONAL[name]}
    assert told == dict.fromkeys(OPTIONAL[name], (0.0, MISSING, OPTIONAL_TEXT))
    others = [mark for part, mark in found.items() if part not in OPTIONAL[name]]
    assert {mark.status for mark in others} == {RIGHT}
    everything = marks(hand_in(tmp_path, {}), name)
    extra = sum(part.points for part in catalogue.load(name).parts if part.is_optional)
    assert sum(mark.earned for mark in everything.values()) == sum(mark.earned for mark in others) + extra


@pytest.mark.long
def test_a_graduate_file_that_cannot_be_run_is_told_and_costs_nothing_else(tmp_path):
    found = marks(hand_in(tmp_path, {"environment.py": [("import taichi as ti", "import taichi as")]}), "a3")
    wrong = {part: mark.message for part, mark in found.items() if mark.status != RIGHT}
    assert set(wrong) == set(OPTIONAL["a3"])
    assert all("of environment.py: SyntaxError" in message for message in wrong.values())


@pytest.mark.long
@pytest.mark.parametrize("mistake", GRADUATE_MISTAKES)
def test_a_mistake_in_the_graduate_part_costs_its_own_part_and_is_told(mistake, tmp_path):
    name, old, new, wrong, told = GRADUATE_MISTAKES[mistake]
    found = marks(hand_in(tmp_path, {HOMES[name]: [(old, new)]}), name, finds=bool(told))
    assert {part for part, mark in found.items() if mark.status != RIGHT} == {wrong}
    assert found[wrong].points > 0
    assert not told or told in [word for finding in found[wrong].findings for word in finding["names"]]


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
    assert "line 5 of camera.py: ImportError" in found["Camera.generate_ray"].message
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


@pytest.mark.long
def test_light_by_a_students_environment_brdf_sampler_and_renderer_has_the_same_mean(student):
    sky = np.linspace(0.5, 1.5, 8)[:, None, None] * np.linspace(0.8, 1.2, 16)[:, None] * np.ones(3)
    own = tt.load_scene_data("sphere", environment=sky)
    theirs = tt.load_scene_data(
        "sphere", environment=student["Environment"](own.environment.pixels), brdfs=[student["BRDF"]()]
    )
    for mode, name in ((1, "uniform"), (2, "brdf")):
        expected = tt.A2Renderer(own, SIZE, SIZE).use(name).render(64).image().mean()
        options = {"sampler": student["UniformSampler"]()}
        found = tt.A2Renderer(theirs, SIZE, SIZE, **options).use(name).render(64).image().mean()
        renderer = student["A2Renderer"](own, SIZE, SIZE)
        renderer.sample_mode[None] = mode
        assert found == pytest.approx(expected, rel=0.06)  # 5 standard errors: ti.random differs in every run
        assert renderer.render(64).image().mean() == pytest.approx(expected, rel=0.06)


def test_what_is_no_file_of_the_course_is_not_taken_for_one(tmp_path):
    assert files.is_of_course(HAND_IN, ["camera.py"])
    solution = catalogue.load("a1").solution_folder
    assert not files.is_of_course(solution, ["camera.py", "ray_intersector.py", "renderer.py"])
    with pytest.raises(tt.InputError, match="none of camera.py"):
        files.find_folder(tmp_path)
