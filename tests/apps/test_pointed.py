"""What lies under the pointer is what a ray meets and what the picture has."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.pointed import Pointed, numbers_of


@pytest.fixture(scope="module")
def renderer():
    start("f32")
    return tt.A1Renderer(tt.load_scene_data("cube"), 40, 30).use("normal").render()


def test_numbers_and_place_are_those_of_the_pixel(renderer):
    told = Pointed(20, 15, renderer).told([renderer])
    value = renderer.image()[15, 20]
    assert [float(x) for x in told["values"][0].split(", ")] == pytest.approx(value, rel=1e-3)
    hit = renderer.scene_data.intersect(*renderer.camera.rays(20, 14))[0]
    position, rest = told["place"].removeprefix("(").split("), ")
    np.testing.assert_allclose([float(x) for x in position.split(", ")], hit.position, rtol=1e-3, atol=1e-4)
    assert rest.startswith(f"{hit.distance:.4g} away: ")
    assert rest.endswith(f"primitive {hit.triangle_id}")


def test_beside_everything_nothing_is_seen(renderer):
    pointed = Pointed(0, 0, renderer)
    assert pointed.told([renderer, renderer]) == {"column": 0, "row": 0, "values": ["0", "0"], "place": "nothing"}


def test_a_pixel_outside_is_brought_into_the_picture(renderer):
    told = Pointed(65000, 65000, renderer).told([renderer])
    assert (told["column"], told["row"]) == (39, 29)


def test_the_place_is_asked_again_when_the_camera_has_moved(renderer):
    pointed = Pointed(20, 15, renderer)
    before, eye = pointed.place(renderer), renderer.camera.eye
    assert pointed.place(renderer) == before
    try:
        renderer.camera.set_camera_parameters(eye=np.array(eye) + [0.3, 0.2, 0.5])
        assert pointed.place(renderer) != before
    finally:
        renderer.camera.set_camera_parameters(eye=eye)


def test_numbers_that_are_the_same_are_told_once():
    assert numbers_of(np.array([0.5, 0.5, 0.5])) == "0.5"
    assert numbers_of(np.array([0.123456, 0.5, 2])) == "0.1235, 0.5, 2"
