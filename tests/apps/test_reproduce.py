"""The lines of Python that a page shows make the same pixels."""

import numpy as np
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.pictures import as_python


def test_the_lines_make_the_same_pixels(tmp_path, monkeypatch):
    start("f32")
    monkeypatch.chdir(tmp_path)
    renderer = tt.A1Renderer(tt.load_scene_data("cube", triangle_test="moller_trumbore"), 16, 12, seed=3)
    renderer.camera.set_camera_parameters(eye=(1, 2, 3), fov=47.3)
    expected = renderer.use("normal").render().image()
    made: dict = {}
    exec(as_python(renderer), made)
    np.testing.assert_array_equal(made["renderer"].image(), expected)
    assert (tmp_path / "normal.png").exists()
