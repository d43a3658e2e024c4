"""A kernel's function that is called from Python says what to call instead."""

import pytest
import taichi as ti
from shapes import SQUARE
from support import needs_patch, start
from taichi.lang.exception import TaichiSyntaxError

import taichi_tracer as tt


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.scene_from_mesh(*SQUARE)


@ti.data_oriented
class Own(tt.Camera):
    """A student's camera."""

    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        return tt.Ray(origin=self.eye, direction=self.at)


RAYS = r"in Python, camera\.rays\(x, y\) gives the rays of pixels as arrays"
HITS = r"in Python, scene\.intersect\(origins, directions\) gives the hits of many rays as arrays"
KERNEL = "call it from a function with @ti.kernel"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda scene: tt.Camera(4, 4).generate_ray(1, 2), f"Camera.generate_ray runs only in kernels: {RAYS}"),
        (lambda scene: tt.Camera(4, 4).generate_ray(), f"Camera.generate_ray runs only in kernels: {RAYS}"),
        (lambda scene: Own(4, 4).generate_ray(1, 2), f"Own.generate_ray runs only in kernels: {RAYS}"),
        (lambda scene: scene.query_ray(None), f"SceneData.query_ray runs only in kernels: {HITS}"),
        (lambda scene: scene.ray_intersector.query_ray(None), f"query_ray runs only in kernels: {HITS}"),
        (lambda scene: scene.ray_intersector.intersect_triangle(None, 0), HITS),
        (lambda scene: tt.BRDF.evaluate_brdf(0, 0, 0, 0), f"BRDF.evaluate_brdf runs only in kernels: {KERNEL}"),
        (lambda scene: tt.BRDF().eval(0, 0, 0, 0), f"BRDF.eval runs only in kernels: {KERNEL}"),
        (lambda scene: tt.no_hit(), f"no_hit runs only in kernels: {KERNEL}"),
    ],
)
def test_the_message_says_what_to_call(scene, call, message):
    needs_patch("advice")
    with pytest.raises(TaichiSyntaxError, match=message):
        call(scene)


def test_kernels_call_them_as_before(scene):
    camera = tt.Camera(1, 1, eye=(0.2, 0.1, 5), at=(0.2, 0.1, 0))

    @ti.kernel
    def distance() -> float:
        return scene.query_ray(camera.generate_ray(0, 0)).distance

    assert distance() == 5


def test_functions_for_both_still_run_in_python(scene):
    @ti.pyfunc
    def double(x):
        return 2 * x

    assert double(4) == 8
    assert tt.Camera(2, 2).compute_matrix().shape == (4, 4)
