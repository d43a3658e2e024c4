"""RT3's pictures: against closed forms, cropped, and those of the shipped documents."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.rt3.renderer import RT3Renderer, renderer_of

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


def test_a_range_that_is_set_before_it_is_shown_counts(ball):
    renderer = RT3Renderer(ball, 60, 41).use("flat")
    renderer.set_depth(zmin=1, zmax=2)
    assert renderer.active.name == "flat"
    assert renderer.use("depth_map").active.zmax == 2


def test_the_question_of_the_three_spheres_has_its_answer():
    """S1 and S3 have the same outline, shifted by (−2, 1); S2 is outside."""
    scene = tt.load_scene_data("rt3/three_spheres")
    renderer = renderer_of(scene)
    renderer.image()
    ids = renderer.aov("triangle_id")
    assert set(np.unique(ids)) == {-1, 0, 2}
    scale = renderer.width / 10.6
    assert (ids == 0).sum() / scale**2 == pytest.approx(4 * np.pi, rel=1e-2)
    lens = 8 * np.arccos(np.sqrt(5) / 4) - np.sqrt(5) / 2 * np.sqrt(16 - 5)  # where S1 hides S3
    assert (ids == 2).sum() / scale**2 == pytest.approx(4 * np.pi - lens, rel=1e-2)


def test_every_integrator_by_its_name():
    scene = tt.load_scene_data("rt3/four_corners")
    renderer = RT3Renderer(scene, 8, 8)
    for name in ("flat", "normal_map", "depth_map"):
        assert renderer.use(name).active.name == name
        assert renderer.srgb == (name == "flat")
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
