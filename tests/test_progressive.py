"""Progressive rendering: what adds samples, what starts over, and what is refused."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.picture.aovs import AOVS
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


@pytest.mark.parametrize("name", ["scene_data", "camera", "width", "jitter", "sampler", "first_sample"])
def test_what_a_picture_was_made_of_cannot_be_assigned(renderer, name):
    with pytest.raises(tt.InputError, match=f"the {name} of a renderer cannot be assigned: make a new renderer"):
        setattr(renderer, name, getattr(renderer, name))


@pytest.fixture(scope="module")
def lit():
    return tt.A2Renderer(scene_data=tt.load_scene_data("cube", environment="studio"), width=16, height=12)


def test_machine_code_is_made_before_the_first_sample(lit):
    lit.render(1)
    in_kernels = sum(kernel.reading + kernel.translating for kernel in compiling.kernels())
    assert lit.film.counts().min() == lit.film.counts().max() == 1
    assert compiling.seconds_spent() > in_kernels


def test_another_seed_starts_over(lit):
    lit.reset()
    first = lit.render(2).image()
    lit.seed = 5
    other = lit.render(2).image()
    assert lit.samples == 2
    assert not np.array_equal(other, first)
    lit.seed = 0
    np.testing.assert_array_equal(lit.render(2).image(), first)


def test_a2_has_the_handouts_setters_and_modes(lit):
    assert tt.A2Renderer.SamplingMode is tt.A2Renderer.SampleMode
    for mode in tt.A2Renderer.SampleMode:
        assert lit.use(mode).active.name == mode.name.lower()
        getattr(lit, f"set_sample_{mode.name.lower()}")()
        assert lit.sample_mode[None] == mode
    with pytest.raises(tt.InputError, match="unknown estimator 'brfd'"):
        lit.use("brfd")


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
