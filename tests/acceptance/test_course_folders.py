"""Folders of the Taichi course as students have them: unfinished, with further methods, with other arguments.

The folders are made of ``tests/course/handin``, a whole one, by leaving methods empty and by exchanging lines.
"""

import ast
import json
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import taichi_tracer as tt

WHOLE = Path(__file__).parent.parent / "course" / "handin"
LATER = {  # what belongs to each class of the course
    "camera.py": ["Camera"],
    "ray_intersector.py": ["RayIntersector"],
    "environment.py": ["Environment"],
    "sampler.py": ["UniformSampler", "BRDF", "MicrofacetBRDF", "MeshLightSampler"],
    "renderer.py": ["A2Renderer", "A3Renderer", "A4Renderer"],
}
KEPT = {"__init__", "set_camera_parameters", "set_intensity", "render", "query_ray of BruteForceRayIntersector"}


def emptied(text, classes):
    """The text of a file, in which the methods of some classes are ``pass``, as in the base code."""
    tree = ast.parse(text)
    for cls in (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name in classes):
        for method in (node for node in cls.body if isinstance(node, ast.FunctionDef) and node.name not in KEPT):
            method.body = [ast.Pass()]
    return ast.unparse(tree)


def folder(path, empty=(), changes=()):
    """A folder of the course: ``empty`` names classes without content, ``changes`` are (file, old, new)."""
    package = path / "taichi_tracer"
    package.mkdir(parents=True)
    for file, classes in LATER.items():
        text = (WHOLE / file).read_text(encoding="utf-8")
        for _, old, new in (one for one in changes if one[0] == file):
            assert old in text, (file, old)
            text = text.replace(old, new)
        (package / file).write_text(emptied(text, set(classes) & set(empty)), encoding="utf-8")
    return path


SMALL = "--size", "32x32"
A2_AND_LATER = ["Environment", *LATER["sampler.py"], *LATER["renderer.py"]]
A3_AND_LATER = ["MicrofacetBRDF", "MeshLightSampler", "A3Renderer", "A4Renderer"]


def picture(name, size=24, spp=1, scene="cornell_box", **options):
    """A picture of a view or an estimator, by the package's interface."""
    made = tt.load_scene_data(scene, **options)
    kind = next(k for k in (tt.A1Renderer, tt.A2Renderer, tt.A4Renderer) if name in k.names())
    return np.asarray(kind(made, size, size).use(name).render(spp).image())


def by_command(*words):
    """What the command line answers: exit code, and all lines."""
    done = subprocess.run(
        [sys.executable, "-m", "taichi_tracer", *map(str, words)], capture_output=True, text=True, timeout=240
    )
    return done.returncode, done.stdout + done.stderr


def test_a_beginner_with_camera_and_intersector_sees_all_views(tmp_path):
    right = {name: picture(name, intersector="brute_force") for name in ("normal", "distance")}
    with tt.course(folder(tmp_path, A2_AND_LATER)) as files:
        for name, expected in right.items():
            found = picture(name, intersector="brute_force")
            assert (np.abs(found - expected).max(axis=2) > 1e-3).mean() < 0.01, name
        (note,) = [line for line in files.notes() if line.startswith("unfinished")]
        assert "BRDF.sample_direction" in note
        assert "Camera" not in note


@pytest.mark.slow
def test_what_is_unfinished_is_an_error_with_its_line_where_a_picture_uses_it(tmp_path):
    beginner = folder(tmp_path / "a", ["RayIntersector", *A2_AND_LATER])
    code, said = by_command("render", "cube", "--view", "hit", *SMALL, "--course", beginner, "-o", tmp_path / "a.png")
    (line,) = [line for line in said.splitlines() if "error:" in line]
    assert code == 2
    assert "ray_intersector.py:" in line
    assert "intersect_triangle" in line
    assert not (tmp_path / "a.png").exists()
    half = folder(tmp_path / "b", ["A2Renderer", *A3_AND_LATER])
    code, said = by_command(
        "render", "sphere", "--estimator", "uniform", *SMALL, "--course", half, "-o", tmp_path / "b.png"
    )
    assert code == 2
    assert "renderer.py:" in said
    assert "shade_ray is not written yet" in said
    code, said = by_command("render", "sphere", "--view", "normal", *SMALL, "--course", half, "-o", tmp_path / "b.png")
    assert code == 0


OF_FACTOR = "def evaluate_brdf_factor(material: Material, w_i: tm.vec3,"
CALLS_FACTOR = "BRDF.evaluate_brdf_factor(material, w_i, n)"
OTHER_ARGUMENTS = [
    ("sampler.py", OF_FACTOR, OF_FACTOR.replace("(", "(pdf: float, cosine: float, ")),
    ("renderer.py", CALLS_FACTOR, CALLS_FACTOR.replace("(", "(1.0, 1.0, ")),
]


@pytest.mark.parametrize(
    ("estimator", "scene", "environment"),
    [
        pytest.param("uniform", "sphere", "white", marks=pytest.mark.slow),
        ("brdf", "specular_spheres", "studio"),
    ],
)
def test_a2_without_its_graduate_part_and_with_other_arguments_runs(tmp_path, estimator, scene, environment):
    """The factor has one argument more, and the density is cancelled: the package's factor runs in its place.

    The student's numbers are ``ti.random``'s, others in each run: 2.5 % are more than five standard deviations.
    """
    empty = ["A2Renderer", *A3_AND_LATER]
    options = {"scene": scene, "environment": environment, "spp": 1024}
    right = picture(estimator, **options).mean(axis=(0, 1))
    made = folder(tmp_path, empty, OTHER_ARGUMENTS)
    for file in ("renderer.py", "ray_intersector.py"):  # its own search looks at every triangle
        (made / "taichi_tracer" / file).unlink()
    with tt.course(made) as files:
        found = picture(estimator, **options).mean(axis=(0, 1))
        assert any("cannot be called as the handout calls them: BRDF.evaluate_brdf_factor" in n for n in files.notes())
    np.testing.assert_allclose(found, right, rtol=0.025)


@pytest.mark.slow
def test_a_miss_has_id_0_at_the_border(tmp_path):
    """A student reads the material before asking whether the ray hit anything; HitData() is all zeros."""
    asks, reads = (
        "        if hit_data.is_hit:\n",
        "material = self.scene_data.material_library.materials[hit_data.material_id]\n",
    )
    old, new = f"{asks}            {reads}", f"        {reads}{asks}"
    expected = picture("uniform", scene="sphere", environment="white", spp=256).mean()
    made = folder(tmp_path, ["A3Renderer", "A4Renderer"], [("renderer.py", old, new)])
    (made / "taichi_tracer" / "ray_intersector.py").unlink()
    with tt.course(made):
        found = picture("uniform", scene="sphere", environment="white", spp=256).mean()
    assert found == pytest.approx(expected, rel=0.05)


FURTHER = """
    @ti.func
    def sample_direction(self, hit_point):
        w, light_id = self.sample_mesh_lights(hit_point)
        self.calls[None] = light_id
        return self.unit * w, light_id
"""
SAMPLER = "class MeshLightSampler:\n    def __init__(self, geometry, material_library) -> None:\n"
OF_CONSTRUCTOR = "        self.unit = 1.0\n        self.calls = ti.field(int, shape=())\n"
CALLS_FURTHER = [
    ("sampler.py", SAMPLER, f"class MeshLightSampler:{FURTHER}\n{SAMPLER.split(chr(10), 1)[1]}{OF_CONSTRUCTOR}"),
    (
        "renderer.py",
        "w, light_id = self.scene_data.mesh_light_sampler.sample_mesh_lights(x)",
        "w, light_id = self.scene_data.mesh_light_sampler.sample_direction(x)",
    ),
]


@pytest.mark.slow
def test_a_renderer_may_call_further_methods_of_the_students_own_classes(tmp_path):
    """Where the package's class stands in, it keeps the student's other methods, and what the constructor makes."""
    expected = picture("environment", spp=1024).mean()
    with tt.course(folder(tmp_path, ["A4Renderer"], CALLS_FURTHER)):
        renderer = tt.A3Renderer(tt.load_scene_data("cornell_box"), 24, 24)
        renderer.sample_mode[None] = renderer.SampleMode.LIGHT
        found = np.asarray(renderer.render(1024).image()).mean()
    assert found == pytest.approx(expected, rel=0.1)


def marks(path, assignment, at):
    """Part → its mark, of the only hand-in in a zip."""
    zipped = at / "260123456.zip"
    with zipfile.ZipFile(zipped, "w") as archive:
        for file in sorted((path / "taichi_tracer").glob("*.py")):
            archive.write(file, f"taichi_tracer/{file.name}")
    code, said = by_command("grade", assignment, zipped, "--json", "--trust")
    assert code == 0, said
    (found,) = json.loads(said[said.index("{") :])["submissions"]
    return {part["name"]: part for part in found["parts"]}


def wrong_of(found):
    """The parts that are judged and have lost points: name → message."""
    judged = {name: part for name, part in found.items() if part["points"] and "optional" not in part["message"]}
    return {name: part["message"] for name, part in judged.items() if part["share"] < 1}


@pytest.mark.slow
def test_stubs_of_later_assignments_and_other_arguments_cost_only_their_own_part(tmp_path):
    found = marks(folder(tmp_path / "f", A3_AND_LATER, OTHER_ARGUMENTS), "a2", tmp_path)
    message = found["BRDF.evaluate_brdf_factor"]["message"]
    assert "cannot be called as the handout calls it" in message
    assert "sampler.py" in message
    assert set(wrong_of(found)) == {"BRDF.evaluate_brdf_factor"}


@pytest.mark.slow
def test_further_methods_cost_nothing(tmp_path):
    found = marks(folder(tmp_path / "f", ["A4Renderer"], CALLS_FURTHER), "a3", tmp_path)
    assert wrong_of(found) == {}
