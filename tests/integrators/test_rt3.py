"""What scene files can ask for beside light: the colour, the normal, the depth, and what lies behind."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.integrators.rt3 import DepthMap, RT3Integrator, depth_of
from taichi_tracer.materials import Material

VIEW = {"eye": (0, 0, 4), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 60.0}

pytestmark = pytest.mark.usefixtures("f32")


def scene_of(tilt=0.0, **options):
    """The square, turned about the y axis; its right edge in the picture is the nearer one."""
    turn = np.array([[np.cos(tilt), 0, -np.sin(tilt)], [0, 1, 0], [np.sin(tilt), 0, np.cos(tilt)]])
    mesh = Mesh(SQUARE[0] @ turn.T, SQUARE[1], materials=[Material(Kd=(0.2, 0.4, 0.8), Ke=(9.0, 9.0, 9.0), Ns=50)])
    return tt.SceneData(mesh, view=VIEW, **options)


def shown(scene, integrator, **options):
    return tt.RT3Renderer(scene, 17, 17, **options).use(integrator).image()


def test_the_normal_map_is_the_view_of_normals():
    scene = scene_of(0.4)
    normals = tt.A1Renderer(scene, 17, 17).use("normal").image()
    np.testing.assert_array_equal(shown(scene, "normal_map"), normals)


def test_depth_is_the_distance_along_the_gaze():
    """Of a plane that faces the camera it is one number, though the rays to its corners are longer."""
    image = shown(scene_of(), DepthMap((1, 0, 0), (0, 0, 1), zmin=3, zmax=7))
    hit = image[..., 1] == 0
    hit &= image.sum(axis=2) > 0
    np.testing.assert_allclose(image[hit], np.tile([0.75, 0, 0.25], (hit.sum(), 1)), atol=1e-6)
    assert hit.sum() > 30


def test_nothing_behind_the_camera_counts_in_the_range(f32):
    scene = tt.scene_from_mesh(
        np.concatenate([SQUARE[0], SQUARE[0] + [0, 0, 50]]), np.concatenate([SQUARE[1], SQUARE[1] + 4])
    )
    assert depth_of(scene.geometry, tt.Camera(4, 4, **VIEW)) == pytest.approx((0, 4))


def test_a_range_that_is_none_is_refused():
    with pytest.raises(tt.InputError, match="depth_map: zmin must be less than zmax, not 2 and 1"):
        DepthMap(zmin=2, zmax=1)


def test_facts_tell_pictures_of_different_ranges_apart():
    a, b = DepthMap(zmin=1), DepthMap(zmin=2)
    assert a.facts() == {"depth map": [[[0, 0, 0], [1, 1, 1]], 1, None]}
    assert a.facts() != b.facts()


def test_an_integrator_of_rt3_must_say_its_colour():
    import taichi as ti

    @ti.data_oriented
    class Unfinished(RT3Integrator):
        name = "unfinished"

    with pytest.raises(Exception, match=r"an integrator of RT3 must say what color\(self, scene, ray, hit\) is"):
        shown(scene_of(), Unfinished())
