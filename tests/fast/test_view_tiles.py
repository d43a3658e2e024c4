"""Views tile by tile have the same bits as pixel by pixel."""

import numpy as np
import pytest
import taichi as ti
from shapes import soup
from support import start

import taichi_tracer as tt
from taichi_tracer.fast.view_tiles import can_show
from taichi_tracer.integrators.base import View

EYE = {"eye": (0.3, 0.5, 4), "at": (0, 0, 0)}
WIDTH, HEIGHT = 29, 22  # no multiples of a tile


@pytest.fixture(scope="module")
def scene():
    """A soup with gaps between the triangles."""
    start("f32")
    return tt.scene_from_mesh(*soup(np.random.default_rng(3), 200))


class Directions(View):
    """The direction of the ray, also where it hits nothing."""

    name = "directions"

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """A colour per direction."""
        return (ray.direction + 1) / 2 + ti.select(hit.is_hit, 1.0, 0.0)


def pictures(scene, view, use_packets, **options):
    """The picture of a view, and the renderer."""
    renderer = tt.A1Renderer(scene, WIDTH, HEIGHT, **options).use(view)
    renderer.camera.set_camera_parameters(**EYE)
    renderer.eye_rays.use_packets = use_packets
    return np.array(renderer.render().image()), renderer


@pytest.mark.parametrize(
    ("view", "options"),
    [pytest.param(Directions(), {"crop": (3, 21, 6, 19)}, id="all rays, cropped")],
)
def test_tiles_have_the_same_bits(scene, view, options):
    pixels, plain = pictures(scene, view, False, **options)
    tiles, renderer = pictures(scene, view, True, **options)
    assert not can_show(plain)
    assert can_show(renderer)
    assert renderer.plan.view_tiles is not None
    np.testing.assert_array_equal(tiles, pixels)
