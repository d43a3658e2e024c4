"""Progressive rendering: what adds samples, what starts over, and what is refused."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from PIL import Image
from shapes import SQUARE
from support import start

import taichi_tracer as tt
from taichi_tracer.files.images import to_bytes


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@pytest.fixture
def renderer():
    return tt.A1Renderer(scene_data=tt.scene_from_mesh(*SQUARE), width=16, height=12)


def test_samples_add_up_and_change_nothing_without_jitter(renderer):
    first = renderer.render().image()
    more = renderer.render(spp=4).image()
    assert renderer.samples == 5
    np.testing.assert_array_equal(first, more)
    assert first.shape == (12, 16, 3)
    assert first.dtype == np.float32


def test_a_new_view_or_camera_starts_over(renderer):
    renderer.render(3)
    renderer.use("normal").render()
    assert renderer.samples == 1
    before = renderer.render().image()
    renderer.camera.set_camera_parameters(eye=(3, 0, 3))
    assert not renderer.is_current()
    assert np.abs(renderer.image() - before).max() > 0.1
    assert renderer.samples == 1
    renderer.reset()
    assert renderer.samples == 0


def test_the_second_picture_by_packets_equals_the_first(renderer):
    first = renderer.use("barycentric").render().image()
    renderer.camera.set_camera_parameters()
    renderer.eye_rays.use_packets = True
    np.testing.assert_array_equal(renderer.render().image(), first)
    assert renderer.eye_rays.packets is not None


def test_every_view_has_a_setter_that_is_use(renderer):
    for view in renderer.offers:
        for name in (view.name, *view.aliases):
            getattr(renderer, f"set_shade_{name}")()
            assert renderer.active.name == view.name
            assert renderer.use(name).active.name == view.name
            assert view.label in getattr(renderer, f"set_shade_{name}").__doc__


def test_canvas_and_image_differ_only_in_which_way_is_up(renderer):
    image = renderer.use("barycentric").render().image()
    np.testing.assert_array_equal(renderer.canvas.to_numpy().transpose(1, 0, 2)[::-1], image)


def test_what_cannot_be_rendered_is_one_line(renderer):
    with pytest.raises(tt.InputError, match="normal"):
        renderer.use("nromal")
    for spp in (0, -1, 1.5):
        with pytest.raises(tt.InputError, match="spp must be a whole number of at least 1"):
            renderer.render(spp)


def test_notebooks_show_a_png(renderer):
    import io

    from PIL import Image

    picture = Image.open(io.BytesIO(renderer.use("hit")._repr_png_()))
    assert picture.size == (16, 12)
    assert "hit, 16×12, 1 samples" in repr(renderer)


def test_a_camera_of_ones_own_gives_the_size():
    camera = tt.Camera(5, 7, eye=(0, 0, 2))
    renderer = tt.A1Renderer(scene_data=tt.scene_from_mesh(*SQUARE), camera=camera)
    assert renderer.image().shape == (7, 5, 3)


def test_jittered_views_are_means_over_the_pixel():
    """The edge of the square is grey, and the more samples, the nearer to the covered part of the pixel."""
    view = {"eye": (0.1, 0, 4), "at": (0.1, 0, 0), "up": (0, 1, 0), "fov": 40.0}
    scene = tt.scene_from_mesh(*SQUARE, view=view)
    renderer = tt.A1Renderer(scene_data=scene, width=16, height=16, jitter=True).use("hit")
    image = renderer.render(256).image()
    covered = ((image > 0.02) & (image < 0.98)).any(axis=-1)
    assert 10 < covered.sum() < 80
    half = 4 * np.tan(np.deg2rad(20))
    np.testing.assert_allclose(image.mean(), 4 / (2 * half) ** 2, atol=2e-3)


@pytest.fixture(scope="module")
def lit():
    return tt.A2Renderer(scene_data=tt.load_scene_data("cube", environment="studio"), width=16, height=12)


def test_a2_has_the_handouts_setters_and_modes(lit):
    assert tt.A2Renderer.SamplingMode is tt.A2Renderer.SampleMode
    for mode in tt.A2Renderer.SampleMode:
        assert lit.use(mode).active.name == mode.value
        getattr(lit, f"set_sample_{mode.value}")()
        assert lit.active.name == mode.value
    with pytest.raises(tt.InputError, match="unknown estimator 'brfd'"):
        lit.use("brfd")


def test_any_change_of_light_camera_or_estimator_starts_over(lit):
    lit.use("brdf").render(4)
    for change in (
        lambda: lit.use("uniform"),
        lambda: lit.scene_data.environment.set_intensity(0.5),
        lambda: lit.scene_data.environment.set_rotation(30),
        lambda: lit.scene_data.set_environment("white"),
        lambda: lit.camera.set_camera_parameters(fov=50),
    ):
        change()
        lit.render()
        assert lit.samples == 1
        lit.render(2)
        assert lit.samples == 3


def test_a_new_environment_is_the_one_that_is_seen(lit):
    lit.scene_data.set_environment("white")
    assert lit.image()[0, 0].tolist() == [1, 1, 1]
    lit.scene_data.environment.set_intensity(3)
    assert lit.image()[0, 0].tolist() == [3, 3, 3]


def test_darkness_is_told():
    dark = tt.A2Renderer(scene_data=tt.load_scene_data("cube", environment="black"), width=8, height=8)
    with pytest.warns(UserWarning, match="nothing in this scene emits light"):
        assert not dark.image().any()
    lamp = tt.A2Renderer(scene_data=tt.load_scene_data("cornell_box"), width=32, height=32)
    assert lamp.image().max() > 1  # a lamp is seen without an environment


def test_the_error_falls_with_samples(lit):
    lit.scene_data.set_environment("studio")
    lit.use("uniform").render(4)
    few = lit.error()
    assert 0.3 < few / lit.render(60).error() / 4 < 3


def test_unknown_samplers_and_seeds_are_refused():
    scene = tt.scene_from_mesh(*SQUARE)
    with pytest.raises(tt.InputError, match="did you mean 'sobol'"):
        tt.A1Renderer(scene, 4, 4, sampler="sobl")
    with pytest.raises(tt.InputError, match="seed must be a whole number"):
        tt.A1Renderer(scene, 4, 4, seed=-1)


@pytest.mark.parametrize("renderer_class", [tt.A1Renderer, tt.A2Renderer, tt.RT3Renderer])
def test_a_name_is_no_scene_yet(renderer_class):
    with pytest.raises(tt.InputError, match=r"Renderer: 'cube' is no scene yet: give load_scene_data\('cube'\)"):
        renderer_class("cube")
    with pytest.raises(tt.InputError, match=f"{renderer_class.__name__}: scene_data must be a scene, .* not None"):
        renderer_class(None)


def test_a_view_that_is_not_finite_is_counted_and_black():
    scene = tt.load_scene_data("cube")

    @ti.func
    def undefined(hit):
        return tm.vec3(0, hit.distance / 0.0, 0)

    renderer = tt.A1Renderer(scene, 16, 16).use(tt.View("undefined", "Undefined", undefined)).render()
    assert renderer.non_finite == (tt.A1Renderer(scene, 16, 16).use("hit").image()[..., 0] > 0).sum()
    assert not renderer.image().any()
    assert renderer.use("normal").render().non_finite == 0


def test_a_saved_picture_has_its_own_encoding_and_its_crop_alone(tmp_path):
    scene = tt.scene_from_mesh(*SQUARE, environment=np.full((1, 2, 3), 0.25))
    light, view = (one(scene, 16, 12, crop=(4, 10, 2, 7)) for one in (tt.A2Renderer, tt.A1Renderer))
    for renderer in (light, view):
        renderer.save(tmp_path / "a.png")
        image = renderer.image()[12 - 7 : 12 - 2, 4:10]
        expected = to_bytes(image, srgb=renderer is light)
        np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png")), expected)
    assert light.srgb
    assert not view.srgb
