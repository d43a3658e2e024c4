"""What new users try first, and what they get."""

import inspect

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from acceptance.command import command

import taichi_tracer as tt


def test_rays_may_have_any_shape():
    scene = tt.load_scene_data("cube")
    origins, direction = np.zeros((2, 5, 3)) + [0, 1, 3], np.array([0.0, 0.0, -1.0])
    hits = scene.intersect(origins, direction)
    assert (hits.distance.shape, hits.normal.shape, hits.points.shape) == ((2, 5), (2, 5, 3), (2, 5, 3))
    assert (hits.distance == 2).all()
    assert hits.to_dict()["normal_z"].shape == (10,)
    blocked = scene.occluded(origins, direction, t_max=np.array([1.0, 3, 1, 3, 1]))
    assert blocked.tolist() == [[False, True, False, True, False]] * 2
    assert scene.intersect([0, 1, 3], [0, 0, -1]).distance.shape == (1,)
    with pytest.raises(tt.InputError, match="do not fit together"):
        scene.intersect(np.zeros((2, 5, 3)), np.zeros((3, 3)))


def test_a_material_takes_the_values_of_registered_brdfs():
    @tt.register
    class Rough(tt.Brdf):
        """A BRDF with a value of its own."""

        name, parameters = "rough_of_a_test", {"sigma_of_a_test": 0.5}

        def describes(self, material, dtype):
            """Materials with this value."""
            return "sigma_of_a_test" in material.extra

        @ti.func
        def eval(self, material, w_o, w_i, n):
            """A constant."""
            return material.Kd * material.sigma_of_a_test

        @ti.func
        def pdf(self, material, w_o, w_i, n):
            """The density of ``sample``."""
            return tm.max(0.0, tm.dot(n, w_i)) / tm.pi

        @ti.func
        def sample(self, material, w_o, n, xi):
            """Near the normal."""
            return n

    material = tt.Material(Kd=(0.1, 0.2, 0.3), sigma_of_a_test=0.0)
    assert material.extra == {"sigma_of_a_test": (0.0,)}
    assert material == tt.Material(Kd=(0.1, 0.2, 0.3), extra={"sigma_of_a_test": 0.0})
    with pytest.raises(TypeError, match="unknown argument of Material 'sigma_of'"):
        tt.Material(sigma_of=0.0)


def test_signatures_have_short_names():
    for function in (tt.scene_from_mesh, tt.load_scene_data, tt.Material, tt.A2Renderer, tt.SceneData.intersect):
        text = str(inspect.signature(function))
        assert "numpy." not in text
        assert "**" not in text
    assert "faces: ArrayLike | None = None" in str(inspect.signature(tt.scene_from_mesh))


def test_a_camera_says_its_own_range():
    class Fisheye(tt.Camera):
        """A camera whose angle may be a full turn."""

        name, largest_fov = "wide_of_a_test", 360.0

    assert Fisheye(8, 8, fov=200).fov == 200
    with pytest.raises(tt.InputError, match="between 0 and 360 degrees"):
        Fisheye(8, 8, fov=400)
    with pytest.raises(tt.InputError, match="between 0 and 180 degrees"):
        tt.Camera(8, 8, fov=200)


def test_the_command_line_helps(tmp_path, capfd):
    assert command("render", "cube", "--estimtor", "mis") == 2
    assert "did you mean --estimator?" in capfd.readouterr().err
    words = ("render", "sphere", "--estimator", "uniform", "--environment", "studio", "--size", "16x16")
    assert command(*words, "--error", "60%", "-o", tmp_path / "a.png") == 0
    assert "--error 5 would take" not in capfd.readouterr().err
    assert command(*words, "-o", tmp_path / "a.png") == 0
    assert "--error 5 would take about" in capfd.readouterr().err
