"""--parts in every command: parts of a file of one's own, files that are wrong, and --plain."""

import numpy as np
import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.studies import hard_cases
from taichi_tracer.studies.hard.catalogue import all_renderer_cases
from taichi_tracer.studies.hard.modes import OWN_TEST
from taichi_tracer.system.registry import PARTS

PARTS_FILE = '''
import taichi as ti
import taichi.math as tm
import taichi_tracer as tt


@tt.register
class Heat(tt.View):
    name, label = "heat", "Heat"

    @ti.func
    def color(self, hit):
        return tm.vec3(1, 0, 0) * hit.distance / 5


@tt.register
class Mine(tt.RayIntersector):
    """The handout's: nothing but intersect_triangle."""

    name = "mine"

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        hit = tt.HitData()
        ids = self.geometry.triangle_vertex_ids[triangle_id]
        v0 = self.geometry.vertices[ids[0]]
        v1 = self.geometry.vertices[ids[1]]
        v2 = self.geometry.vertices[ids[2]]
        e1, e2, s = v1 - v0, v2 - v0, ray.origin - v0
        det = tm.dot(e1, tm.cross(ray.direction, e2))
        u = tm.dot(s, tm.cross(ray.direction, e2)) / det
        v = tm.dot(ray.direction, tm.cross(s, e1)) / det
        t = tm.dot(e2, tm.cross(s, e1)) / det
        if u >= 0 and v >= 0 and u + v <= 1 and t > self.EPSILON:
            hit.is_hit = 1
            hit.triangle_id = triangle_id
            hit.distance = t
            hit.barycentric_coords = tm.vec2(u, v)
            hit.normal = tm.vec3(0.6, 0, 0.8)  # wrong, so that every picture shows it
            hit.material_id = self.geometry.triangle_material_ids[triangle_id]
        return hit


@ti.func
def doubled_t(o, d, v0, v1, v2):
    e1, e2, s = v1 - v0, v2 - v0, o - v0
    det = tm.dot(e1, tm.cross(d, e2))
    u, v = tm.dot(s, tm.cross(d, e2)) / det, tm.dot(d, tm.cross(s, e1)) / det
    return u >= 0 and v >= 0 and u + v <= 0.5, tm.dot(e2, tm.cross(s, e1)) / det, u, v, det


tt.register(tt.TriangleTest("half_triangles", doubled_t))


@tt.register
class Grey(tt.Brdf):
    name = "grey"

    def describes(self, material, dtype):
        return material.Ns <= 1

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return tm.vec3(0.5 / tm.pi)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return 1 / (4 * tm.pi)

    @ti.func
    def sample(self, material, w_o, n, xi):
        z = 1 - 2 * xi.x
        r, phi = ti.sqrt(ti.max(0.0, 1 - z * z)), 2 * tm.pi * xi.y
        return tm.vec3(r * tm.cos(phi), r * tm.sin(phi), z)


@tt.register
class Still(tt.Sampler):
    name = "still"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        return tm.vec2(0.25, 0.75)


@tt.register
class Fisheye(tt.Camera):
    name = "fisheye"

    @ti.func
    def generate_camera_coords(self, ndc_coords):
        r = ndc_coords.norm()
        return tm.vec4(ndc_coords * ti.sin(r) / ti.max(r, 1e-6), ti.cos(r), 0)


@tt.register
class Twice(tt.DirectLight):
    name, label = "twice", "Twice the light"

    @ti.func
    def sample(self, scene, surface, xi):
        w_i = surface.sample(xi)
        return w_i, 2 * surface.weight(w_i)


@tt.register
class Lamp(tt.Light):
    name, is_delta = "lamp", True

    @ti.func
    def sample(self, x, xi):
        to_lamp = tm.vec3(0, 1.8, 2) - x
        return to_lamp.normalized(), to_lamp.norm(), tm.vec3(4) / to_lamp.norm_sqr(), 1.0
'''
NAMES = ("heat", "mine", "half_triangles", "grey", "still", "fisheye", "twice", "lamp")


@pytest.fixture(autouse=True)
def _forget(tmp_path):
    """What the files of a test registered is forgotten at its end."""
    yield
    for file in tmp_path.rglob("*.py"):
        for part in PARTS.registered_by(file):
            PARTS.remove(part)


@pytest.fixture
def parts(tmp_path, monkeypatch):
    """``--parts`` with a file of parts of every kind, in the folder where the test works."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_parts.py").write_text(PARTS_FILE)
    return ["--parts", "my_parts.py"]


def render(name, *words):
    """The picture of a command, as an array."""
    assert main(["render", *words, "-o", f"{name}.npy"]) == 0
    return np.load(f"{name}.npy")


# ── every command ──


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        ("render", NAMES),
        ("view", NAMES),
        ("info", NAMES),
        ("export", ("heat", "still", "fisheye", "twice")),
        ("effects", tuple(name for name in NAMES if name != "heat")),
        ("accuracy", tuple(name for name in NAMES if name != "heat")),
        ("hardcases", ("mine", "half_triangles", "grey")),
        ("merge", ("still",)),
    ],
)
def test_a_help_lists_the_names_of_the_file_with_the_others(command, shown, parts, capsys):
    with pytest.raises(SystemExit) as end:
        main([command, "--help", *parts])
    assert end.value.code == 0
    words = capsys.readouterr().out.replace("*", "").replace(",", "").split()
    assert [name for name in shown if name not in words] == []


def test_hard_cases_try_an_intersector_a_triangle_test_and_a_brdf(parts, monkeypatch):
    tried = []

    def run(level, **_options):
        tried.append((hard_cases.modes_of(level), all_renderer_cases()))
        return hard_cases.SuiteResult(level, {}, [], [])

    monkeypatch.setattr(hard_cases, "run", run)
    assert main(["hardcases", "--quick", *parts]) == 0
    ((modes, cases),) = tried
    own = [mode for mode in modes if mode.intersector == "mine"]
    assert {mode.triangle_test for mode in own} == {OWN_TEST}
    assert len(own) == 3  # a precision each, and f32 with fast_math
    assert {mode.intersector for mode in modes if mode.triangle_test == "half_triangles"} == {"wide_bvh", "brute_force"}
    assert all(mode.tries_everything for mode in own)
    assert any(mode.intersector == "bvh" for mode in hard_cases.modes_of("full"))
    assert [case.name for case in cases if case.name.startswith("BRDF grey: ")] != []


# ── files that are wrong ──


COLOR = "    @ti.func\n    def color(self, hit):\n        return hit.normal\n"
BEGIN = "import taichi as ti\nimport taichi_tracer as tt\n\n\n"
WRONG = {
    "missing": (None, "--parts my_parts.py: no such file"),
    "a syntax error": (BEGIN + "class A(tt.View\n", "my_parts.py:5: SyntaxError: '(' was never closed"),
    "an error while it runs": (BEGIN + "x = 1\ny = x / 0\n", "my_parts.py:6: ZeroDivisionError: division by zero"),
    "an unknown module": (BEGIN + "import no_such_module\n", "my_parts.py:5: ModuleNotFoundError: No module named"),
    "it ends the program": (BEGIN + "raise SystemExit(0)\n", "my_parts.py:5: SystemExit: 0"),
    "nothing registered": (BEGIN + "class A(tt.View):\n    name = 'a'\n", "my_parts.py: the file registers nothing"),
    "the package's name": (
        BEGIN + "@tt.register\nclass A(tt.Camera):\n    name = 'perspective'\n",
        "my_parts.py:5: register: there is another camera called 'perspective', in the package",
    ),
    "the package's name, as an object": (
        BEGIN + "tt.register(tt.View('normal', 'Normal', None))\n",
        "my_parts.py:5: register: there is another integrator called 'normal', in the package",
    ),
    "no name of its own": (
        BEGIN + "@tt.register\nclass A(tt.OrthographicCamera):\n    pass\n",
        "my_parts.py:5: register: there is another camera called 'orthographic'",
    ),
    "no name": (BEGIN + "@tt.register\nclass A(tt.View):\n    pass\n", "my_parts.py:5: register: A needs a name"),
    "no part": (BEGIN + "@tt.register\nclass A:\n    name = 'a'\n", "my_parts.py:5: register: A derives from none"),
    "a name twice": (
        BEGIN + f"@tt.register\nclass A(tt.View):\n    name = 'a'\n\n{COLOR}\n\n@tt.register\nclass B(A):\n    pass\n",
        "my_parts.py:14: register: there is another integrator called 'a'",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_line_with_the_place(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text, told = WRONG[case]
    if text is not None:
        (tmp_path / "my_parts.py").write_text(text)
    for words in (["info", "cube"], ["render", "--help"]):
        assert main([*words, "--parts", "my_parts.py"]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert error.startswith(f"taichi-tracer: error: {told[:11]}")
        assert told in error


# ── the plain forms ──
