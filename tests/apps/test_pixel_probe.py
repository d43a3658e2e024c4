"""What lies under the pointer is what a ray meets and what the picture has."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.page.pixel_probe import look_at


@pytest.fixture(scope="module")
def renderer():
    start("f32")
    return tt.A1Renderer(tt.load_scene_data("cube"), 40, 30).use("normal").render()


def test_numbers_and_place_are_those_of_the_pixel(renderer):
    told = look_at(20, 15, [renderer])
    value = renderer.image()[15, 20]
    assert [float(x) for x in told["values"][0].split(", ")] == pytest.approx(value, rel=1e-3)
    hit = renderer.scene_data.intersect(*renderer.camera.rays(20, 14))[0]
    position, rest = told["place"].removeprefix("(").split("), ")
    np.testing.assert_allclose([float(x) for x in position.split(", ")], hit.position, rtol=1e-3, atol=1e-4)
    assert rest.startswith(f"{hit.distance:.4g} away: ")
    assert rest.endswith(f"primitive {hit.triangle_id}")
