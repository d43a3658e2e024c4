"""Progressive rendering: what adds samples, what starts over, and what is refused."""

import time

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from PIL import Image
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.fast.primary_hits import PrimaryHits
from taichi_tracer.files.images import told_display
from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.forms import EyeRays
from taichi_tracer.picture.aovs import AOVS
from taichi_tracer.picture.progress import Target
from taichi_tracer.system import compiling
from taichi_tracer.tones.display import Display

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture
def renderer():
    return tt.A1Renderer(scene_data=tt.scene_from_mesh(*SQUARE), width=16, height=12)


@pytest.mark.long
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


@pytest.mark.long
def test_the_second_picture_by_packets_equals_the_first(renderer):
    first = renderer.use("barycentric").render().image()
    renderer.camera.set_camera_parameters()
    renderer.eye_rays.use_packets = True
    np.testing.assert_array_equal(renderer.render().image(), first)
    assert renderer.eye_rays.packets is not None


def test_small_random_pictures_trace_their_rays_in_the_kernel_and_large_ones_keep_the_hits():
    """With the same bits."""
    scene = tt.scene_from_mesh(*SQUARE, environment="white")

    def renderer_of(size):
        return tt.A3Renderer(scene, size, size, seed=3).use("brdf")

    small = renderer_of(24)
    assert isinstance(small.eye_rays, EyeRays)
    assert any("too small for packets" in line for line in small.receipt())
    kept = renderer_of(24)
    kept.plan.choose_eye_rays(in_tiles=True)
    kept.eye_rays.use_packets = False
    np.testing.assert_array_equal(small.render(3).image(), kept.render(3).image())
    assert isinstance(small.eye_rays, EyeRays)
    assert kept.eye_rays.traces == 3
    assert isinstance(renderer_of(256).eye_rays, PrimaryHits)


def test_the_form_of_new_rays_is_chosen_when_the_length_of_the_picture_is_known():
    scene = tt.scene_from_mesh(*SQUARE, environment="white")

    def form_for(first, then=None):
        """The class of the eye rays after one or two calls of render."""
        renderer = tt.A3Renderer(scene, 256, 256).use("brdf")
        for options in (first, then):
            if options is not None:
                renderer.plan.expect(Target(**options), False)
                renderer.plan.passes += options.get("spp", 0)
        return type(renderer.eye_rays)

    assert form_for({"spp": 1}) is PrimaryHits  # as in a window: nobody knows how many more there will be
    assert form_for({"spp": 64}) is EyeRays
    assert form_for({"spp": 1024}) is PrimaryHits
    assert form_for({"time": 1.0}) is EyeRays
    assert form_for({"time": 60.0}) is PrimaryHits
    assert form_for({"error": 0.02}) is EyeRays
    assert form_for({"spp": 64}, {"spp": 1024}) is PrimaryHits
    assert form_for({"spp": 64}, {"spp": 64}) is EyeRays
    assert form_for({"spp": 500}, {"spp": 64}) is PrimaryHits  # more pictures seem to follow
    renderer = tt.A3Renderer(scene, 256, 256).use("brdf")
    renderer.plan.expect(Target(spp=4), False)
    renderer.plan.passes = 512
    renderer.plan.expect(Target(spp=4), False)
    assert renderer.eye_rays.is_much_work()  # packets at once, so that no other form is compiled in between
    renderer = tt.A3Renderer(scene, 256, 256).use("brdf").render()
    renderer.render(4)
    assert isinstance(renderer.eye_rays, PrimaryHits)  # it is compiled already


def test_every_view_of_the_handout_has_a_setter_that_is_use(renderer):
    """Under each of its names, explained."""
    views = ("hit", "triangle_id", "distance", "barycentric", "normal", "material_id")
    for view in (view for view in renderer.offers if view.name in views):
        for name in (view.name, *view.aliases):
            setter = getattr(renderer, f"set_shade_{name}")
            assert setter() is renderer
            assert renderer.active.name == view.name
            assert renderer.use(name).active.name == view.name
            assert setter.__doc__.startswith("Show ")


@pytest.mark.long
def test_what_is_rendered_is_chosen_by_name_class_or_object(renderer):
    @ti.data_oriented
    class Red(tt.View):
        name, label, aliases = "red", "Red", ("rot",)

        @ti.func
        def color(self, hit):
            return tm.vec3(1, 0, 0)

    assert renderer.use("normals").active.name == "normal"
    assert "red" not in renderer.names()
    own = Red()
    for chosen in (Red, own, "red", "rot"):
        assert renderer.use(chosen).active.name == "red"
    assert [view.name for view in renderer.offers][-1] == "red"
    image = renderer.image()
    assert image[6, 8].tolist() == [1, 0, 0]
    assert not image[0, 0].any()
    made = tt.A1Renderer(renderer.scene_data, 16, 12, integrator=own)
    np.testing.assert_array_equal(made.image(), image)
    with pytest.raises(tt.InputError, match="integrator: 7 is neither a name nor a part of this kind"):
        renderer.use(7)


def test_an_integrator_belongs_to_one_renderer():
    """What one keeps of its picture, such as a range of depths, is not another's."""
    scene = tt.scene_from_mesh(*SQUARE)
    a, b = (tt.RT3Renderer(scene, 8, 8).use("depth_map") for _ in range(2))
    assert a.active is not b.active
    assert a.use("flat").use("depth_map").active is a.use("depth_map").active


@pytest.mark.exhaustive
def test_the_plain_forms_give_the_same_bits():
    """Views and light, with jitter and without; the receipt says which forms ran. Few random rays are not kept."""
    kept, alone = "hits are kept", "one by one, as they are written"
    pictures = (tt.A1Renderer, {}, kept), (tt.A1Renderer, {"jitter": True}, alone), (tt.A2Renderer, {}, alone)
    for one, options, runs in pictures:
        scene = tt.scene_from_mesh(*SQUARE, environment="studio")
        fast, plain = (one(scene, 16, 12, fast=fast, **options).render(3) for fast in (None, False))
        np.testing.assert_array_equal(fast.image(), plain.image())
        assert any(line.startswith(f"eye rays        {runs}") for line in fast.receipt())
        assert any(
            line.startswith("eye rays        one by one, as they are written: fast=False") for line in plain.receipt()
        )
    quick, readable = (tt.scene_from_mesh(*SQUARE, environment="studio", fast=fast) for fast in (True, False))
    images = [tt.A2Renderer(scene, 16, 12).use("mis").render(3).image() for scene in (quick, readable)]
    np.testing.assert_array_equal(*images)


@pytest.mark.long
def test_a_camera_is_chosen_by_name_class_or_object():
    """By name or class it shows where the scene's own view looks."""
    view = {"eye": (0, 0, 3), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 60.0}
    scene = tt.scene_from_mesh(*SQUARE, view=view)
    by_name, by_class = (tt.A1Renderer(scene, 16, 12, camera=c) for c in ("orthographic", tt.OrthographicCamera))
    own = tt.A1Renderer(
        scene, 3, 3, camera=tt.OrthographicCamera(16, 12, eye=(0, 0, 3), screen_window=(-2, 2, -1.5, 1.5))
    )
    assert (own.width, own.height) == (16, 12)
    np.testing.assert_array_equal(by_name.use("hit").image(), by_class.use("hit").image())
    assert by_name.camera.name == "orthographic"
    assert by_name.camera.screen_window[3] == pytest.approx(3 * np.tan(np.deg2rad(30)))
    assert own.use("hit").image().any()


@pytest.mark.long
def test_canvas_and_image_differ_only_in_which_way_is_up(renderer):
    image = renderer.use("barycentric").render().image()
    np.testing.assert_array_equal(renderer.canvas.to_numpy().transpose(1, 0, 2)[::-1], image)


def test_what_cannot_be_rendered_is_one_line(renderer):
    with pytest.raises(tt.InputError, match="normal"):
        renderer.use("nromal")
    for spp in (0, -1, 1.5):
        with pytest.raises(tt.InputError, match="spp must be a"):
            renderer.render(spp)


@pytest.mark.long
def test_notebooks_show_a_png(renderer):
    import io

    from PIL import Image

    picture = Image.open(io.BytesIO(renderer.use("hit")._repr_png_()))
    assert picture.size == (16, 12)
    assert "hit, 16×12, 1 samples" in repr(renderer)


@pytest.mark.long
def test_a_camera_of_ones_own_gives_the_size():
    camera = tt.Camera(5, 7, eye=(0, 0, 2))
    renderer = tt.A1Renderer(scene_data=tt.scene_from_mesh(*SQUARE), camera=camera)
    assert renderer.image().shape == (7, 5, 3)


@pytest.mark.long
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
        assert lit.use(mode).active.name == mode.integrator
        getattr(lit, f"set_sample_{mode.name.lower()}")()
        assert lit.sample_mode[None] == mode
    with pytest.raises(tt.InputError, match="unknown estimator 'brfd'"):
        lit.use("brfd")


@pytest.mark.exhaustive
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


def test_going_back_to_an_environment_compiles_nothing(lit):
    def pictures():
        for environment in environments:
            lit.scene_data.set_environment(environment)
            yield lit.use("brdf").render().image().tobytes()

    environments = [tt.Environment(np.full((1, 2, 3), [[[k, 1, 2], [1, 1, k]]])) for k in (1, 5)]
    before = lit.scene_data.environment
    first = list(pictures())
    began = time.perf_counter()
    assert list(pictures()) == first
    assert first[0] != first[1]
    assert [kernel.name for kernel in compiling.kernels(since=began)] == []
    lit.scene_data.set_environment(before)


@pytest.mark.long
def test_a_new_environment_is_the_one_that_is_seen(lit):
    lit.scene_data.set_environment("white")
    assert lit.image()[0, 0].tolist() == [1, 1, 1]
    lit.scene_data.environment.set_intensity(3)
    assert lit.image()[0, 0].tolist() == [3, 3, 3]


@pytest.mark.exhaustive
def test_darkness_is_told():
    dark = tt.A2Renderer(scene_data=tt.load_scene_data("cube", environment="black"), width=8, height=8)
    with pytest.warns(UserWarning, match="nothing in this scene emits light"):
        assert not dark.image().any()
    lamp = tt.A2Renderer(scene_data=tt.load_scene_data("cornell_box"), width=32, height=32)
    assert lamp.image().max() > 1  # a lamp is seen without an environment
    assert lamp.scene_data.environment is None
    open_scene, said = tt.load_scene_data("cube"), tt.load_scene_data("cube", environment=None)
    tt.A1Renderer(open_scene, 8, 8).render()
    assert open_scene.environment is None  # nothing has asked for light
    with pytest.warns(UserWarning, match="the environment 'studio' lights it; environment=None leaves it dark"):
        assert tt.A3Renderer(open_scene, 8, 8).render().image().any()
    with pytest.warns(UserWarning, match="give it an environment"):
        assert not tt.A3Renderer(said, 8, 8).render().image().any()


@pytest.mark.long
def test_the_error_falls_with_samples(lit):
    lit.scene_data.set_environment("studio")
    lit.use("uniform").render(4)
    few = lit.error()
    assert 0.3 < few / lit.render(60).error() / 4 < 3


def test_unknown_samplers_and_seeds_are_refused():
    scene = tt.scene_from_mesh(*SQUARE)
    with pytest.raises(tt.InputError, match="did you mean 'sobol'"):
        tt.A1Renderer(scene, 4, 4, sampler="sobl")
    for name, value in (("seed", -1), ("seed", 2**32), ("first_sample", 0.5)):
        with pytest.raises(tt.InputError, match=f"{name} must be a whole number"):
            tt.A1Renderer(scene, 4, 4, **{name: value})
    with pytest.raises(tt.InputError, match="film: crop"):
        tt.A1Renderer(scene, 4, 4, crop=(0, 5, 0, 4))


@pytest.mark.parametrize("renderer_class", [tt.A1Renderer, tt.A2Renderer, tt.RT3Renderer])
def test_a_name_is_no_scene_yet(renderer_class):
    with pytest.raises(tt.InputError, match=r"Renderer: 'cube' is no scene yet: give load_scene_data\('cube'\)"):
        renderer_class("cube")
    with pytest.raises(tt.InputError, match=f"{renderer_class.__name__}: scene_data must be a scene, .* not None"):
        renderer_class(None)


@ti.data_oriented
class OwnDistance(tt.A1Renderer):
    """A student's view of the distance, with the ``max_distance`` of the handout."""

    @ti.func
    def shade_distance(self, hit_data):
        return tm.vec3(0, hit_data.distance / self.max_distance, 0)

    @ti.func
    def shade_normal(self, hit_data):
        return self.shade_distance(hit_data)


def test_a_distance_of_ones_own_stays_in_charge_and_reads_max_distance():
    camera = tt.Camera(8, 8, eye=(0, 0, 3), at=(0, 0, 0), fov=20)
    renderer = OwnDistance(tt.scene_from_mesh(*SQUARE, intersector="brute_force"), camera=camera)
    for view in ("distance", "normal"):
        renderer.max_distance = None
        np.testing.assert_allclose(renderer.use(view).image()[4, 4], [0, 0.3, 0], atol=5e-3)
        renderer.max_distance = 4
        np.testing.assert_allclose(renderer.image()[4, 4], [0, 0.75, 0], atol=1e-2)
    renderer.camera.set_camera_parameters(eye=(0, 0, 30))
    renderer.max_distance = None
    renderer.use("distance").render()
    assert renderer.max_distance == 50
    assert renderer.notes() == []  # a view of one's own need not have this white


@pytest.mark.long
def test_a_view_that_is_not_finite_is_counted_and_black():
    scene = tt.load_scene_data("cube")

    @ti.func
    def undefined(hit):
        return tm.vec3(0, hit.distance / 0.0, 0)

    renderer = tt.A1Renderer(scene, 16, 16).use(tt.View("undefined", "Undefined", undefined)).render()
    assert renderer.non_finite == (tt.A1Renderer(scene, 16, 16).use("hit").image()[..., 0] > 0).sum()
    assert not renderer.image().any()
    assert renderer.use("normal").render().non_finite == 0


@pytest.mark.long
@pytest.mark.parametrize(("name", "value"), [("eye", (3, 0, 3)), ("fov", 20), ("handedness", "right")])
def test_a_parameter_that_is_assigned_to_the_camera_starts_over(renderer, name, value):
    before = renderer.use("normal").render(3).image()
    setattr(renderer.camera, name, value)
    assert not renderer.is_current()
    renderer.image()
    assert renderer.samples == 1
    assert name == "handedness" or np.abs(renderer.use("hit").image() - before).max() > 0


@pytest.mark.long
def test_an_image_is_saved_as_the_renderer_saves_it(tmp_path):
    """Light gets the sRGB curve in 8 bits, views do not, and no argument is needed."""
    scene = tt.scene_from_mesh(*SQUARE, environment=np.full((1, 2, 3), 0.25))
    for one in (tt.A2Renderer(scene, 16, 12), tt.A1Renderer(scene, 16, 12).use("normal")):
        assert one.image().srgb == one.srgb
        for extension in (".png", ".jpg", ".pfm", ".npy"):
            one.save(tmp_path / f"a{extension}")
            tt.save_image(tmp_path / f"b{extension}", one.image())
            tt.save_image(tmp_path / f"c{extension}", np.asarray(one.image()), srgb=one.srgb)
            a, b, c = ((tmp_path / f"{name}{extension}").read_bytes() for name in "abc")
            assert a == c
            assert b == c


@pytest.mark.long
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


# ── raw arrays ──

MISS = {"distance": np.inf, "triangle_id": -1, "material_id": -1}


@pytest.fixture(scope="module")
def box():
    return tt.A1Renderer(tt.load_scene_data("cornell_box"), 24, 16, crop=(4, 20, 3, 13), jitter=True)


@pytest.mark.parametrize("name", [name for name in AOVS if not AOVS[name].is_look])
def test_raw_arrays_are_what_the_rays_of_the_pixels_hit(box, name):
    """In the layout of image(), at the centres of the pixels, whatever the picture shows."""
    found = box.aov(name)
    hits = box.scene_data.intersect(*box.camera.rays(*np.mgrid[:24, :16][:, :, ::-1].transpose(0, 2, 1)))
    expected = getattr(hits, AOVS[name].member).copy()
    expected[~hits.is_hit] = MISS.get(name, np.nan)
    assert 0 < hits.is_hit.sum() < 24 * 16
    assert found.dtype == (np.int32 if name.endswith("_id") else np.float32)
    np.testing.assert_array_equal(found, expected.reshape(16, 24, *expected.shape[1:]))


@pytest.mark.long
def test_raw_arrays_agree_with_the_views(box):
    views = tt.A1Renderer(box.scene_data, 24, 16)
    hit = views.use("hit").image()[..., 0] > 0
    np.testing.assert_array_equal(np.isfinite(box.aov("distance")), hit)
    np.testing.assert_allclose(box.aov("normal")[hit], 2 * views.use("normal").image()[hit] - 1, atol=1e-6)
    near = hit & (box.aov("distance") < 10)
    np.testing.assert_allclose(box.aov("distance")[near] / 10, views.use("distance").image()[near][:, 0], rtol=1e-6)
    np.testing.assert_allclose(box.aov("barycentric")[hit], views.use("barycentric").image()[hit][:, :2], atol=1e-7)


def test_an_exr_has_the_raw_arrays_of_its_crop_under_the_names_of_the_convention(box, tmp_path):
    oiio = pytest.importorskip("OpenImageIO")
    box.use("normal").save(tmp_path / "a.exr", aovs=AOVS)
    file = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    names, pixels = list(file.spec().channelnames), file.read_image("float")
    layers = ["Z", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z", "barycentric.u", "barycentric.v"]
    layers += ["uv.u", "uv.v", "albedo.R", "albedo.G", "albedo.B"]
    assert sorted(names) == sorted(["R", "G", "B", *layers, "triangle_id", "material_id"])
    for aov in AOVS.values():
        stored = np.squeeze(pixels[..., [names.index(channel) for channel in aov.channels]])
        np.testing.assert_array_equal(stored, box.film.own_pixels(box.aov(aov.name)))
    np.testing.assert_array_equal(tt.read_image(tmp_path / "a.exr"), box.film.own_pixels(box.image()))


def test_raw_arrays_that_cannot_be_had_are_told_before_anything_is_rendered(box, tmp_path):
    box.reset()
    with pytest.raises(tt.InputError, match="unknown AOV 'depth': known are distance, position"):
        box.aov("depth")
    with pytest.raises(tt.InputError, match=r"a\.png: a \.png file has no place for Z: give a name that ends in \.exr"):
        box.save(tmp_path / "a.png", aovs="distance")
    assert box.samples == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_a_display_changes_how_light_is_shown_and_nothing_else(tmp_path):
    scene = tt.scene_from_mesh(*SQUARE, environment=np.full((1, 2, 3), 3.0))
    light, view = (one(scene, 16, 12) for one in (tt.A2Renderer, tt.A1Renderer))
    for renderer in (light, view):
        plain = renderer.render(4).image()
        error, facts, samples = renderer.error(), renderer.facts(), renderer.samples
        assert renderer.set_display(exposure=-2) is renderer
        renderer.set_display(tone="filmic")
        assert str(renderer.display) == "exposure -2 stops, tone curve filmic"
        np.testing.assert_array_equal(renderer.image(), plain)
        np.testing.assert_equal((float(renderer.error()), renderer.facts()), (float(error), facts))
        assert renderer.samples == samples
        assert renderer.is_current()
        shown = renderer.display if renderer is light else Display()
        renderer.save(tmp_path / "a.png")
        np.testing.assert_array_equal(
            np.asarray(Image.open(tmp_path / "a.png")), to_bytes(plain, srgb=renderer is light, display=shown)
        )
        assert renderer._repr_png_() == (tmp_path / "a.png").read_bytes()
        assert told_display(tmp_path / "a.png") == (str(shown) if renderer is light else None)
    with pytest.raises(tt.InputError, match="exposure must be between"):
        light.set_display(exposure=100)
    assert light.display == Display(-2, "filmic")


def test_a_value_of_one_renderer_leaves_the_picture_of_another(f32):
    """Both have copies of the integrator with which a renderer begins."""
    scene = tt.load_scene_data("cube", environment="studio")
    first = tt.A4Renderer(scene, 4, 4).use("explicit").render(2)
    second = tt.A4Renderer(scene, 4, 4)
    second.max_bounces = 7
    assert first.is_current()
    assert first.max_bounces == 5


@pytest.mark.parametrize("size", [("32", 32), (32, None), (32.5, 32), (0, 3)])
def test_what_is_no_size_is_one_line(size):
    with pytest.raises(tt.InputError, match="camera: (width|height) must be a whole number of at least 1, not"):
        tt.A1Renderer(tt.load_scene_data("cube"), *size)


def test_what_another_renderer_shows_is_told():
    scene = tt.load_scene_data("cube")
    with pytest.raises(tt.InputError, match="unknown view 'mis': known are hit, .*. It belongs to A2Renderer"):
        tt.A1Renderer(scene, 8, 8, integrator="mis")
    with pytest.raises(tt.InputError, match="unknown estimator 'triangle_ID': .* It belongs to A1Renderer"):
        tt.A2Renderer(scene, 8, 8).use("triangle_ID")
