"""The course's own scripts: their imports, their start of Taichi, their loop, their fields with ``[None]``."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from acceptance.command import process

import taichi_tracer as tt

NAMES = {
    "renderer": "A1Renderer A2Renderer A3Renderer A4Renderer EnvISRenderer",
    "camera_controller": "CameraController",
    "scene_data_loader": "load_scene_data SceneName EnvironmentName load_geometry load_materials load_environment",
    "camera": "Camera",
    "ray": "Ray HitData",
    "geometry": "Geometry",
    "materials": "Material MaterialLibrary",
    "environment": "Environment",
    "ray_intersector": "RayIntersector BruteForceRayIntersector",
    "scene_data": "SceneData",
    "sampler": "UniformSampler BRDF MicrofacetBRDF MeshLightSampler ortho_frames reflect",
}
SETTERS = {
    "A1Renderer": "shade_hit shade_triangle_id shade_triangle_ID shade_distance shade_barycentric shade_barycentrics "
    "shade_normal shade_normals shade_material_id shade_material_ID",
    "A2Renderer": "sample_uniform sample_uniform_sphere sample_hemisphere sample_brdf sample_microfacet "
    "sample_environment sample_light sample_mis sample_mis_power sample_mis_balance",
    "A3Renderer": "sample_uniform sample_brdf sample_light sample_mis sample_mis_one_sample",
    "A4Renderer": "shading_implicit shading_explicit",
}
BEGIN = """
import taichi as ti
import taichi.math as tm
ti.init(arch=ti.cpu, default_fp=ti.f32, default_ip=ti.i32)
from taichi_tracer.camera_controller import CameraController
from taichi_tracer.renderer import A1Renderer, A2Renderer, A3Renderer, A4Renderer
from taichi_tracer.scene_data_loader import EnvironmentName, SceneName, load_scene_data
"""
VIEWS = """
class Window:
    def __init__(self): self.keys = ()
    def is_pressed(self, *keys): return any(key in self.keys for key in keys)

renderer = A1Renderer(width=24, height=16, scene_data=load_scene_data(SceneName.CORNELL_BOX))
renderer.camera.set_camera_parameters(eye=tm.vec3([0.0, 1.0, 3.0]), at=tm.vec3([0.0, 1.0, 0.0]),
                                      up=tm.vec3([0.0, 1.0, 0.0]), fov=60.0)
window = Window()
controller = CameraController(renderer.camera, window)
assert renderer.canvas.shape == (24, 16)
seen = []
for mode in A1Renderer.ShadeMode:
    renderer.shade_mode[None] = mode
    for frame in range(2):
        controller.update()
        renderer.render()
    assert renderer.shade_mode[None] == mode
    seen.append(renderer.canvas.to_numpy())
assert len({image.tobytes() for image in seen}) == len(seen) == 6
before = renderer.camera.eye[None]
window.keys = ("w",)
controller.update(), controller.update()
assert renderer.camera.eye[None].y > before.y, renderer.camera.eye
assert renderer.camera.camera_to_world[None].to_numpy().shape == (4, 4)
print("the script ended")
"""
LIGHT = """
lit = A3Renderer(width=16, height=16, scene_data=load_scene_data(SceneName.CORNELL_BOX, EnvironmentName.BLACK))
lit.set_sample_mis()
lit.render(), lit.render()
assert lit.iter_counter[None] == 2
lit.mis_plight[None] = 0.25
assert abs(lit.mis_pbrdf[None] - 0.75) < 1e-6
lit.render()
assert lit.iter_counter[None] == 1
lit.scene_data.environment.set_intensity(2.0)
assert lit.scene_data.environment.intensity[None] == 2.0

paths = A4Renderer(width=16, height=16, scene_data=load_scene_data(SceneName.CORNELL_BOX))
paths.max_bounces[None] = 2
paths.rr_termination_probabilty[None] = 0.1
paths.set_shading_implicit()
paths.render()
paths.postprocess()
assert paths.canvas_postprocessed.to_numpy().shape == (16, 16, 3)
assert float(paths.canvas.to_numpy().max()) > 0
print("the script ended")
"""


@pytest.mark.parametrize("file", NAMES)
def test_every_name_of_the_course_is_in_its_file(file):
    module = importlib.import_module(f"taichi_tracer.{file}")
    assert [name for name in NAMES[file].split() if not hasattr(module, name)] == []


def test_every_setter_of_the_course_chooses_something():
    scene = tt.load_scene_data("cornell_box", environment="white")
    for kind, names in SETTERS.items():
        renderer = getattr(tt, kind)(scene_data=scene, width=8, height=8)
        chosen = []
        for name in names.split():
            getattr(renderer, f"set_{name}")()
            chosen.append(renderer.active.name)
        assert len(set(chosen)) >= min(2, len(chosen)), kind
        assert chosen[0] == names.split()[0].partition("_")[2], kind


def test_the_fields_of_the_geometry_count_from_0():
    geometry = tt.load_scene_data("sphere").geometry
    ids, normal_ids = geometry.triangle_vertex_ids.to_numpy(), geometry.triangle_normal_ids.to_numpy()
    vertices, normals = geometry.vertices.to_numpy(), geometry.normals.to_numpy()
    assert ids.shape == normal_ids.shape == (int(geometry.n_triangles), 3)
    assert (ids.min(), ids.max()) == (0, len(vertices) - 1)
    assert (normal_ids.min(), geometry.triangle_material_ids.to_numpy().max()) == (0, 0)
    # The normals of a sphere point away from its centre.
    out = vertices[ids] - vertices.mean(0)
    assert ((out * normals[normal_ids]).sum(-1) > 0.99 * np.linalg.norm(out, axis=-1)).all()


@pytest.mark.parametrize(
    "script", [pytest.param(VIEWS, id="views"), pytest.param(LIGHT, id="light", marks=pytest.mark.slow)]
)
def test_a_script_of_the_course_runs_with_its_own_start(script, tmp_path):
    (tmp_path / "script.py").write_text(BEGIN + script)
    done = process("script.py", folder=tmp_path)
    assert "the script ended" in done.stdout, done.stderr[-3000:]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["A1", "A2", "A3", "A4"])
def test_a_program_without_a_display_writes_pictures(name, tmp_path):
    """The picture is smaller than that of the program, and has the same kernels."""
    program = (Path(tt.__file__).parents[1] / "interactive" / f"{name}.py").read_text(encoding="utf-8")
    small = program.replace("512", "64").replace("768", "64").replace("384", "64")
    (tmp_path / "program.py").write_text(small, encoding="utf-8")
    done = process("program.py", folder=tmp_path, DISPLAY="", WAYLAND_DISPLAY="")
    assert done.returncode == 0, done.stderr[-2000:]
    assert any(np.ptp(tt.read_image(file)) > 0 for file in (tmp_path / "renders").iterdir())
