"""What one window shows: settings over one camera, and the scenes and renderers that they make."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.apps.page.renderer_state import RendererState, look_at
from taichi_tracer.renderer import A1Renderer, A2Renderer

VERTICES = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 10.0
FACES = [[0, 1, 2], [0, 2, 3]]


def renderer_of(renderer_class=A1Renderer, **options):
    scene = tt.scene_from_mesh(VERTICES, FACES, intersector="brute_force", **options)
    return renderer_class(scene, width=8, height=6, seed=3)


@pytest.fixture(scope="module")
def state():
    """A scene without light."""
    return RendererState(renderer_of(triangle_test="moller_trumbore").use("normal"))


def test_the_first_picture_of_light_gets_one_and_keeps_camera_and_seed(state):
    first = state.renderer
    state.change("view", "mis")
    assert isinstance(state.renderer, A2Renderer)
    assert state.renderer.active.name == "mis"
    assert state.renderer.camera is first.camera
    assert state.renderer.seed == 3
    assert state.settings.environment == "studio"
    assert state.renderer.image().any()
    lit = state.renderer
    state.change("view", "hit")
    assert state.renderer is first
    state.change("view", "brdf")
    assert state.renderer is lit


@pytest.fixture
def lamps():
    """A scene whose two triangles emit light."""
    return RendererState(renderer_of(material=tt.Material(Ke=(1, 1, 1))))


def offered(state):
    """The controls by their names."""
    return {one["name"]: one for one in state.controls()}


def test_the_choice_of_lamps_is_offered_where_it_matters_and_keeps_the_lengths_of_paths(lamps):
    assert "lamp_choice" not in offered(lamps)  # a view shows no light
    lamps.change("view", "implicit")
    assert "lamp_choice" not in offered(lamps)  # no sample of the lights is taken
    lamps.change("view", "explicit")
    assert offered(lamps)["lamp_choice"]["names"] == tt.system.parts.PARTS.names("lamp choice")
    first, before = lamps.renderer, lamps.settings
    lamps.change("max_bounces", 7)
    lamps.change("lamp_choice", "area")
    assert lamps.settings.lamp_choice == "area"
    assert lamps.renderer is not first
    assert (lamps.renderer.active.name, lamps.renderer.max_bounces) == ("explicit", 7)
    lamps.change("view", "normal")
    lamps.change("triangle_test", "moller_trumbore")
    lamps.change("view", "path")
    assert lamps.renderer.max_bounces == 7
    lamps.show(before)
    assert lamps.renderer is first
    assert lamps.settings == before


def test_a_control_says_what_it_takes_and_a_wrong_value_changes_nothing(lamps):
    lamps.change("view", "path")
    found = offered(lamps)
    assert (found["max_bounces"]["low"], found["max_bounces"]["step"]) == (0, 1)
    assert found["environment"]["names"][-1] == "none"
    assert "how many surfaces" in found["max_bounces"]["help"]
    before = lamps.settings
    for name, value in (("max_bounces", "many"), ("environment", "nowhere"), ("seed", 3), ("fov", "nan")):
        with pytest.raises(tt.InputError):
            lamps.change(name, value)
    assert lamps.settings == before


def test_numbers_and_place_are_those_of_the_pixel():
    start("f32")
    renderer = tt.A1Renderer(tt.load_scene_data("cube"), 40, 30).use("normal").render()
    told = look_at(20, 15, [renderer])
    value = renderer.image()[15, 20]
    assert [float(x) for x in told["values"][0].split(", ")] == pytest.approx(value, rel=1e-3)
    hit = renderer.scene_data.intersect(*renderer.camera.rays(20, 14))[0]
    position, rest = told["place"].removeprefix("(").split("), ")
    np.testing.assert_allclose([float(x) for x in position.split(", ")], hit.position, rtol=1e-3, atol=1e-4)
    assert rest.startswith(f"{hit.distance:.4g} away: ")
    assert rest.endswith(f"primitive {hit.triangle_id}")
