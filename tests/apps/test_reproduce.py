"""The lines of Python that are told make the same pixels."""

from support import start

import taichi_tracer as tt
from taichi_tracer.apps.reproduce import as_python
from taichi_tracer.environment import load_environment

SIZE = (16, 12)


def view(scene):
    found = tt.A1Renderer(scene, *SIZE, camera="orthographic", jitter=True, sampler="independent").use("distance")
    found.max_distance = 3.25
    return found


def estimator(scene):
    crop = (2, 14, 1, 11)
    found = tt.A3Renderer(scene, *SIZE, seed=7, first_sample=3, crop=crop).use("mis_one_sample")
    found.set_weights(0.25, 0.75).set_display(exposure=1.5, tone="filmic")
    found.camera.set_camera_parameters(eye=(1.1, 2.3, 3.7), fov=33.3, handedness="left")
    return found


def paths(scene):
    found = tt.A4Renderer(scene, *SIZE).use("explicit")
    found.path_settings.set(max_bounces=3, rr_start_bounce=1, rr_termination_probability=0.3, bounces=(1, 2))
    return found


def maps(scene):
    found = tt.MapRenderer(scene, *SIZE, of="implicit").use("triangles")
    found.path_settings.set(max_bounces=2)
    return found


def adaptive(scene):
    return tt.A2Renderer(scene, *SIZE, adaptive=True, sampler="independent").use("brdf")


def light(lookup="bilinear"):
    return load_environment("studio", intensity=0.5, rotation=30.0, lookup=lookup)


SCENES = {
    view: ("cube", {"triangle_test": "moller_trumbore", "smooth": True, "ground": True}),
    estimator: ("cornell_box", {"lamp_choice": "area", "two_sided_lamps": True}),
    paths: ("cube", {"environment": light, "intersector": "brute_force"}),
    maps: ("cornell_box", {}),
    adaptive: ("cube", {"environment": "studio", "effects": "all"}),
}


def test_what_no_text_can_say_is_told():
    start("f32")

    class Own(tt.Camera):
        """A student's."""

    renderer = tt.A1Renderer(tt.load_scene_data("cube", background=(1, 0, 0)), *SIZE, camera=Own)
    told = as_python(renderer)
    assert "# the camera 'perspective' is an object of your own program: add it" in told
    assert "# the background is an object of your own program" in told
