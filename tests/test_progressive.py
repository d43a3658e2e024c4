"""Progressive rendering: what adds samples, what starts over, and what is refused."""

import time

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.fast.primary_hits import PrimaryHits
from taichi_tracer.forms import EyeRays
from taichi_tracer.picture.aovs import AOVS
from taichi_tracer.picture.progress import Target
from taichi_tracer.system import compiling

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture
def renderer():
    return tt.A1Renderer(scene_data=tt.scene_from_mesh(*SQUARE), width=16, height=12)


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


def test_an_integrator_belongs_to_one_renderer():
    """What one keeps of its picture, such as a range of depths, is not another's."""
    scene = tt.scene_from_mesh(*SQUARE)
    a, b = (tt.RT3Renderer(scene, 8, 8).use("depth_map") for _ in range(2))
    assert a.active is not b.active
    assert a.use("flat").use("depth_map").active is a.use("depth_map").active


def test_what_cannot_be_rendered_is_one_line(renderer):
    with pytest.raises(tt.InputError, match="normal"):
        renderer.use("nromal")
    for spp in (0, -1, 1.5):
        with pytest.raises(tt.InputError, match="spp must be a"):
            renderer.render(spp)


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
