"""RT3's pictures: against closed forms, cropped, and those of the shipped documents."""

import numpy as np
import pytest
from oracles import backgrounds, cameras, spheres
from support import long_except

import taichi_tracer as tt
from taichi_tracer.camera import make_camera
from taichi_tracer.rt3.renderer import RT3Renderer, renderer_of

BALL = (0.25, 0.5, 1.0, 1.5)
CORNERS = [(0, 0, 0.2), (0, 1, 0.2), (1, 1, 0.2), (1, 0, 0.2)]

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """One red sphere before four corners, seen in perspective."""
    path = tmp_path_factory.mktemp("rt3") / "ball.xml"
    path.write_text(
        '<RT3><lookat look_from="0 1 -5" look_at="0 0.5 0" up="0 1 0"/><camera type="perspective" fovy="50"/>'
        '<film x_res="60" y_res="41"/><world_begin/>'
        '<background type="4_colors" bl="0 0 0.2" tl="0 1 0.2" tr="1 1 0.2" br="1 0 0.2"/>'
        '<material type="flat" color="204 51 0"/><object type="sphere" radius="1.5" center="0.25 0.5 1"/>'
        '<world_end/><integrator type="depth_map" near_color="1 0 0" far_color="0 0 1" zmin="4" zmax="6"/>'
        '<camera type="orthographic" screen_window="-3 3 -2.05 2.05"/><render_again/></RT3>'
    )
    return tt.load_scene_data(path)


def oracle_hits(view, shape):
    """What the oracle meets through every pixel: (hit, depth along the gaze, normal, clear of the outline)."""
    options = {"fovy": view.get("fov"), "screen_window": view.get("screen_window")}
    place = (60, 41, view["eye"], view["at"], view["up"])
    o, d = cameras.rays(view["projection"], *place, **{k: v for k, v in options.items() if v is not None})
    ids, t, normal, margin = spheres.nearest(o.reshape(-1, 3), d.reshape(-1, 3), [BALL])
    w = cameras.frame(view["eye"], view["at"], view["up"])[2]
    depth = np.where(ids >= 0, t, 0).reshape(shape) * (d @ w)
    parts = (ids >= 0).reshape(shape), depth, normal.reshape(*shape, 3), (margin > 1e-3).reshape(shape)
    return tuple(part[::-1] for part in parts)


@pytest.mark.long
@pytest.mark.parametrize("number", long_except([0, 1], 1))
def test_pictures_are_those_of_the_closed_form(ball, number):
    """Both cameras, every integrator, the background behind."""
    shot = ball.shots[number]
    renderer = renderer_of(ball, ball.shots[1], camera=make_camera(60, 41, **shot.view))
    hit, depth, normal, clear = oracle_hits(shot.view, (41, 60))
    assert 0.1 < hit.mean() < 0.9
    assert clear.mean() > 0.95
    s = np.clip((depth - 4) / 2, 0, 1)[..., None]
    shown = {"flat": [0.8, 0.2, 0], "normal_map": (normal + 1) / 2, "depth_map": (1 - s) * [1, 0, 0] + s * [0, 0, 1]}
    assert set(shown) <= {integrator.name for integrator in renderer.offers}
    for name, color in shown.items():
        expected = np.where(hit[..., None], color, backgrounds.corners(60, 41, *CORNERS))
        np.testing.assert_allclose(renderer.use(name).image()[clear], expected[clear], atol=1e-5, err_msg=name)


@pytest.mark.long
def test_another_range_of_depth_starts_over(ball):
    renderer = RT3Renderer(ball, 60, 41).use("depth_map")
    renderer.set_depth((0, 0, 0), (1, 1, 1))
    renderer.image()
    before = renderer.samples
    renderer.set_depth(zmin=1, zmax=2)
    assert before == 1
    assert not renderer.is_current()
    with pytest.raises(tt.InputError, match="zmin must be less than zmax"):
        renderer.set_depth(zmin=2, zmax=1)


def test_a_range_that_is_set_before_it_is_shown_counts(ball):
    renderer = RT3Renderer(ball, 60, 41).use("flat")
    renderer.set_depth(zmin=1, zmax=2)
    assert renderer.active.name == "flat"
    assert renderer.use("depth_map").active.zmax == 2


@pytest.mark.exhaustive
@pytest.mark.parametrize(("renderer_class", "use_packets"), [(RT3Renderer, True), (tt.A2Renderer, False)])
def test_a_crop_is_cut_out_of_the_whole_bit_for_bit(ball, renderer_class, use_packets):
    """By packets and by single rays, with jitter and without; and nothing else is written."""
    ball.set_environment("white")
    whole, part = (renderer_class(ball, 60, 41, crop=crop) for crop in (None, (13, 38, 5, 30)))
    part.eye_rays.use_packets = use_packets
    full, cut = whole.render(2).image(), part.render(2).image()
    np.testing.assert_array_equal(part.film.own_pixels(cut), full[41 - 30 : 41 - 5, 13:38])
    inside = np.zeros((41, 60), bool)
    inside[41 - 30 : 41 - 5, 13:38] = True
    assert not cut[~inside].any()
    assert full[inside].any()


DOCUMENTS = [name for name in tt.scene_names() if name.startswith("rt3/")]


@pytest.mark.long
@pytest.mark.parametrize("name", long_except(DOCUMENTS, "rt3/two_views"))
def test_every_shipped_document_loads_and_renders(name):
    scene = tt.load_scene_data(name)
    told = [note for note in scene.notes if "C-11" not in note and "the world is empty" not in note]
    assert told == []
    assert any("the world is empty" in note for note in scene.notes) == (scene.geometry.n_primitives == 0)
    renderer = renderer_of(scene, scene.shots[-1], width=48, height=32)
    assert renderer.render().image().any()
    assert renderer.non_finite == 0


@pytest.mark.long
def test_the_examples_of_the_document_render_as_it_says():
    """One colour on every pixel; C-11 of the first is told, and the second has its own window (C-10)."""
    first, second = (tt.load_scene_data(f"rt3/document_{name}") for name in ("orthographic", "perspective"))
    assert any("stretched by 17 %" in note for note in first.notes)
    assert [note.split(": ")[-1] for note in second.notes] == [
        "the world is empty, so that pictures of it show only the background"
    ]
    for scene in (first, second):
        image = renderer_of(scene, width=28, height=18).image()
        np.testing.assert_array_equal(image, np.broadcast_to(np.float32([0.14, 0.19, 0.26]), image.shape))
    camera = renderer_of(second).camera
    assert (camera.width, camera.height) == (2800, 1800)
    assert camera.screen_window == pytest.approx((-0.41681, 0.41681, -0.26795, 0.26795), abs=1e-5)


def test_the_question_of_the_three_spheres_has_its_answer():
    """S1 and S3 have the same outline, shifted by (−2, 1); S2 is outside."""
    scene = tt.load_scene_data("rt3/three_spheres")
    renderer = renderer_of(scene)
    renderer.image()
    ids = renderer.eye_rays.to_image("triangle_id")
    assert set(np.unique(ids)) == {-1, 0, 2}
    scale = renderer.width / 10.6
    assert (ids == 0).sum() / scale**2 == pytest.approx(4 * np.pi, rel=1e-2)
    lens = 8 * np.arccos(np.sqrt(5) / 4) - np.sqrt(5) / 2 * np.sqrt(16 - 5)  # where S1 hides S3
    assert (ids == 2).sum() / scale**2 == pytest.approx(4 * np.pi - lens, rel=1e-2)


def test_a_setter_for_every_integrator():
    scene = tt.load_scene_data("rt3/four_corners")
    renderer = RT3Renderer(scene, 8, 8)
    for name in ("flat", "normal_map", "depth_map"):
        setter = getattr(renderer, f"set_integrator_{name}")
        assert setter().active.name == name
        assert setter.__doc__.startswith("Show ")
        assert renderer.srgb == (name == "flat")
    assert renderer.set_integrator_flat_color().active.name == "flat"
    assert renderer.use("flat_color").active.name == "flat"


def test_a_document_that_asks_for_light_gets_the_renderer_of_light(tmp_path):
    """With the estimator that it names; a size and a camera of one's own take the place of the film's."""
    path = tmp_path / "lit.xml"
    path.write_text(
        '<RT3><lookat look_from="0 0 -5" look_at="0 0 0" up="0 1 0"/><camera type="perspective" fovy="50"/>'
        '<film x_res="30" y_res="20" crop_window="0 0.5 0 1"/><world_begin/><world_end/>'
        '<integrator type="direct" estimator="mis"/><render_again/></RT3>'
    )
    shot = tt.load_scene_data(path, environment="white").shots[1]
    scene = tt.load_scene_data(path, environment="white")
    renderer = renderer_of(scene, shot)
    assert isinstance(renderer, tt.A2Renderer)
    assert (renderer.active.name, renderer.width, renderer.height) == ("mis", 30, 20)
    assert renderer.film.crop == (0, 15, 0, 20)
    small = renderer_of(scene, shot, width=10, height=8)
    assert (small.width, small.height, small.film.crop) == (10, 8, (0, 5, 0, 8))
    camera = tt.Camera(6, 4)
    assert renderer_of(scene, scene.shots[0], camera=camera).camera is camera
