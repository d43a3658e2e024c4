"""What one window can show: views and estimators over one camera, light, triangle test, and white."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.choices import Choices, after
from taichi_tracer.renderer import A1Renderer, A2Renderer, A4Renderer

VERTICES = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 10.0
FACES = [[0, 1, 2], [0, 2, 3]]


def renderer_of(renderer_class=A1Renderer, **options):
    scene = tt.scene_from_mesh(VERTICES, FACES, intersector="brute_force", **options)
    return renderer_class(scene, width=8, height=6, seed=3)


@pytest.fixture(scope="module")
def choices():
    """Choices of a scene without light."""
    return Choices(renderer_of(triangle_test="moller_trumbore").use("normal"))


def test_the_first_picture_of_light_gets_one_and_keeps_camera_and_seed(choices):
    first = choices.renderer
    choices.use(A2Renderer, "mis")
    assert type(choices.renderer) is A2Renderer
    assert choices.renderer.active.name == "mis"
    assert choices.renderer.camera is first.camera
    assert choices.renderer.seed == 3
    assert choices.environment == "studio"
    assert choices.renderer.image().any()
    lit = choices.renderer
    choices.use(A1Renderer, "hit")
    assert choices.renderer is first
    choices.use(A2Renderer, "brdf")
    assert choices.renderer is lit


@pytest.fixture
def lamps():
    """Choices of a scene whose two triangles emit light."""
    return Choices(renderer_of(material=tt.Material(Ke=(1, 1, 1))))


def test_the_choice_of_lamps_is_offered_where_it_matters_and_keeps_the_lengths_of_paths(lamps):
    assert lamps.lamp_choices == []  # a view shows no light
    lamps.use(A4Renderer, "implicit")
    assert lamps.lamp_choices == []  # no sample of the lights is taken
    lamps.use(A4Renderer, "explicit")
    assert lamps.lamp_choices == tt.system.registry.PARTS.names("lamp choice")
    first = lamps.renderer
    first.max_bounces = 7
    lamps.next_lamp_choice()
    assert lamps.lamp_choice == after("power", lamps.lamp_choices)
    assert lamps.renderer is not first
    assert (lamps.renderer.active.name, lamps.renderer.max_bounces) == ("explicit", 7)
    lamps.use(A1Renderer, "normal")
    lamps.next_triangle_test()
    lamps.use(A4Renderer, "path")
    assert lamps.renderer.max_bounces == 7
    lamps.renderer.max_bounces = 2
    while lamps.renderer is not first:
        lamps.next_triangle_test() if lamps.triangle_test != "watertight" else lamps.next_lamp_choice()
    assert first.max_bounces == 2
