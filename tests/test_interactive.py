"""interactive/: thin programs that run from any folder, with a window or without one."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import taichi_tracer as tt
from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.renderer import A1Renderer, A2Renderer

PROGRAMS = sorted((Path(__file__).parents[1] / "interactive").glob("*.py"))


def test_there_are_programs():
    assert [p.name for p in PROGRAMS] == ["A1.py", "A2.py", "A3.py", "A4.py"]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda p: p.name)
def test_programs_stay_thin(program):
    assert len(program.read_text(encoding="utf-8").splitlines()) < 30


def run_without_a_display(name, folder):
    """A program's standard output; it must end well."""
    program = next(p for p in PROGRAMS if p.name == name)
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment["PYTHONPATH"] = os.pathsep.join([str(Path(tt.__file__).parents[1]), environment.get("PYTHONPATH", "")])
    if not sys.platform.startswith("linux"):
        pytest.skip("a window would open")
    command = [sys.executable, str(program)]
    result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    assert str(folder / "renders") in result.stdout
    assert "For a window: " in result.stdout
    return result.stdout


@pytest.mark.exhaustive
def test_a2_without_a_display_writes_a_picture_by_every_estimator(tmp_path):
    run_without_a_display("A2.py", tmp_path)
    written = sorted(p.name for p in (tmp_path / "renders").iterdir())
    assert written == sorted(f"specular_spheres_{name}.png" for name in A2Renderer.names())
    for path in (tmp_path / "renders").iterdir():
        assert np.asarray(Image.open(path)).std() > 10


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("program", "scene", "names"),
    [("A3.py", "veach_plates", tt.A3Renderer.names()), ("A4.py", "cornell_box", tt.A4Renderer.names())],
)
def test_a3_and_a4_without_a_display_write_a_picture_by_every_integrator(program, scene, names, tmp_path):
    run_without_a_display(program, tmp_path)
    written = sorted(p.name for p in (tmp_path / "renders").iterdir())
    assert written == sorted(f"{scene}_{name}.png" for name in names)
    for path in (tmp_path / "renders").iterdir():
        assert np.asarray(Image.open(path)).std() > 10


@pytest.mark.long
def test_a1_without_a_display_writes_the_six_views_of_the_course(tmp_path):
    run_without_a_display("A1.py", tmp_path)
    written = sorted(p.name for p in (tmp_path / "renders").iterdir())
    assert written == sorted(f"cornell_box_{name}.png" for name in A1Renderer.names())

    scene = tt.load_scene_data("cornell_box", intersector="brute_force")
    renderer = A1Renderer(scene, width=512, height=512)
    renderer.camera.set_camera_parameters(eye=(0, 1, 3), at=(0, 1, 0), up=(0, 1, 0), fov=60.0)
    for name in ("distance", "material_id"):
        expected = to_bytes(renderer.use(name).render().image())
        assert (np.asarray(Image.open(tmp_path / "renders" / f"cornell_box_{name}.png")) == expected).all()
