"""What one window can show: views and estimators over one camera, light, triangle test, and white."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.apps.choices import Choices, after
from taichi_tracer.apps.same_again import as_command
from taichi_tracer.maps import MapRenderer
from taichi_tracer.renderer import A1Renderer, A2Renderer, A3Renderer, A4Renderer

VERTICES = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 10.0
FACES = [[0, 1, 2], [0, 2, 3]]


def renderer_of(renderer_class=A1Renderer, **options):
    scene = tt.scene_from_mesh(VERTICES, FACES, intersector="brute_force", **options)
    return renderer_class(scene, width=8, height=6, seed=3)


@pytest.fixture(scope="module")
def choices():
    """Choices of a scene without light."""
    return Choices(renderer_of(triangle_test="moller_trumbore").use("normal"))


def test_views_and_estimators_are_offered_in_one_order(choices):
    def names(choices):
        return [(c.what, [one.name for one in offers]) for c, offers in choices.offered]

    of = (A1Renderer, A3Renderer, A4Renderer, MapRenderer)
    views, estimators, paths, maps = ((c.what, c.names()) for c in of)
    assert names(choices) == [views, estimators, paths, maps]
    assert names(Choices(renderer_of(A2Renderer))) == [views, estimators, paths, maps]
    assert names(Choices(renderer_of(A4Renderer))) == [views, estimators, paths, maps]


def test_a_renderer_of_ones_own_takes_the_place_of_the_packages():
    class Own(A1Renderer):
        """A student's."""

    own = Own(renderer_of().scene_data, width=8, height=6)
    assert [c for c, _ in Choices(own).offered] == [Own, A3Renderer, A4Renderer, MapRenderer]


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


def test_the_environments_come_one_after_another_and_none_stays_none(choices):
    found = [choices.environment]
    for _ in range(len(choices.environments)):
        choices.next_environment()
        found.append(choices.environment)
    assert found[0] == found[-1]
    assert set(found) == {*tt.files.shipped.shipped_environments(), "none"}
    choices.set_environment("none")
    choices.use(A2Renderer, "uniform")
    assert choices.scene.environment is None


def test_another_environment_keeps_intensity_rotation_and_look_up():
    own = tt.Environment(np.ones((2, 4, 3)), 2.0, 30.0, "bilinear", name="own")
    choices = Choices(renderer_of(A2Renderer, environment=own))
    assert choices.environments[0] == "own"
    choices.set_environment("white")
    changed = choices.scene.environment
    assert (changed.intensity, changed.rotation, changed.lookup) == (2.0, 30.0, "bilinear")
    choices.set_environment("own")
    assert choices.scene.environment is own


def test_a_ground_comes_and_goes(choices):
    scene, number = choices.scene, choices.scene.geometry.n_primitives
    choices.next_ground()
    assert (choices.ground, choices.scene.geometry.n_primitives) == ("a large square", number + 2)
    assert "--ground" in as_command(choices.renderer)
    choices.next_ground()
    assert (choices.ground, choices.scene) == ("nothing", scene)
    assert "--ground" not in as_command(choices.renderer, ["--ground"])


def test_the_triangle_test_changes_and_changes_back(choices):
    choices.use(A1Renderer, "triangle_id")
    before, picture = choices.renderer, choices.renderer.image()
    choices.next_triangle_test()
    assert choices.triangle_test == after("moller_trumbore", choices.triangle_tests)
    assert choices.renderer is not before
    assert choices.renderer.camera is before.camera
    assert choices.renderer.active.name == "triangle_id"
    np.testing.assert_array_equal(choices.renderer.image(), picture)
    while choices.triangle_test != "moller_trumbore":
        choices.next_triangle_test()
    assert choices.renderer is before
    before.scene_data.check_alive()


def test_white_stays_while_the_camera_moves_and_can_be_chosen():
    renderer = renderer_of()
    fitting = renderer.max_distance
    assert fitting > 10
    choices = Choices(renderer.use("distance"))
    assert choices.white == choices.usual_white == fitting
    renderer.camera.set_camera_parameters(eye=(0, 0, 900))
    assert renderer.max_distance == fitting
    choices.set_white(7.0)
    assert (choices.white, choices.usual_white, renderer.max_distance) == (7.0, fitting, 7.0)
    light = Choices(renderer_of(A2Renderer, environment="white"))
    assert light.white is None
    light.set_white(None)
    light.use(A1Renderer, "hit")
    assert light.white == light.usual_white


@pytest.fixture
def lamps():
    """Choices of a scene whose two triangles emit light."""
    return Choices(renderer_of(material=tt.Material(Ke=(1, 1, 1))))


def test_a_scene_with_lamps_is_lit_by_them_alone_unless_one_chooses_more(lamps):
    for renderer_class, name in ((A3Renderer, "mis"), (A4Renderer, "path")):
        lamps.use(renderer_class, name)
        assert lamps.environment == "none"
    lamps.next_environment()
    assert lamps.environment != "none"


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


def test_the_weights_go_along_to_another_scene(lamps):
    lamps.use(A3Renderer, "mis_one_sample")
    lamps.renderer.mis_plight = 0.75
    lamps.next_triangle_test()
    assert (lamps.renderer.mis_plight, lamps.renderer.mis_pbrdf) == (0.75, 0.5)


def test_after_goes_on_at_the_beginning():
    assert [after(name, ["a", "b"]) for name in "ab"] == ["b", "a"]
