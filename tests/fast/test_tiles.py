"""Samples taken tile by tile: the same bits as pixel by pixel, and only where that is certain."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.fast.tiles import LONG, SECONDS_BEFORE, SIDE, can_take_tiles, is_worth_tiles
from taichi_tracer.integrators.direct_light import BrdfSampling, MultipleImportanceSampling
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.picture.progress import Progress, Target

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def scene():
    return tt.load_scene_data("specular_spheres", environment="sunny")


def pictures(scene, estimator, width=SIDE + 8, height=SIDE - 4, spp=3, **options):
    """The same picture tile by tile and pixel by pixel, after a few samples."""
    both = []
    for use_tiles in (True, False):
        renderer = tt.A2Renderer(scene, width, height, **options).use(estimator)
        renderer.use_tiles = use_tiles
        renderer.render(spp)
        assert (renderer.plan.tiles is not None) == use_tiles
        both.append(renderer)
    return both


def assert_same(tiles, pixels):
    """The same picture, the same error, and the same near misses."""
    np.testing.assert_array_equal(tiles.image().view(np.int32), pixels.image().view(np.int32))
    (a, b) = (renderer.film.to_arrays() for renderer in (tiles, pixels))
    assert a.keys() == b.keys()
    for name, array in a.items():
        np.testing.assert_array_equal(array, b[name], err_msg=name)
    ours, theirs = tiles.film.unseen.counted(), pixels.film.unseen.counted()
    assert (ours is None) == (theirs is None)
    for name in ("near", "met", "per_pixel") if ours is not None else ():
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    assert pixels.image().max() > 0


OTHERS = [{"crop": (3, 39, 5, 21)}, {"adaptive": True}, {"sampler": "independent"}]
OTHERS += [{"camera": "orthographic"}, {"jitter": False}]


def can(scene, estimator="mis", kind=tt.A2Renderer, **options):
    """Whether tiles can be used."""
    renderer = kind(scene, 8, 8, **options).use(estimator)
    return can_take_tiles(renderer, renderer.kernel_scene(), renderer.active)


def test_what_a_student_wrote_gets_its_light_at_once(scene):
    class OwnShading(tt.A2Renderer):
        @ti.func
        def shade_ray(self, ray):
            return tm.vec3(0.5)

    class Darker(BrdfSampling):
        name = "darker"

        @ti.func
        def reflected(self, scene, surface, rng):
            return 0.5 * BrdfSampling.reflected(self, scene, surface, rng)

    assert can(scene)
    assert not can(scene, kind=OwnShading)
    assert not can(scene, fast=False)
    assert not can(scene, Darker())


def test_scenes_whose_samples_are_other_sums():
    lit = {"environment": "studio"}
    for name, options in (("cornell_box", lit), ("cornell_box", {}), ("cube", {"environment": "white"})):
        other = tt.load_scene_data(name, **options)
        assert not can(other)
        other.destroy()


def after(samples, seconds, **target):
    """The progress of a picture after some samples."""
    progress = Progress(Target(**target))
    for i in range(samples):
        progress.took(seconds, compiles=i == 0)
    return progress


def test_only_long_pictures_are_worth_the_compilation():
    assert not is_worth_tiles(Progress(Target(spp=10**6)), 0.0)  # its speed is not known yet
    assert not is_worth_tiles(after(1, 3.0, spp=100), 0.0)  # it was compiled, which took most of the time
    assert not is_worth_tiles(after(3, 0.1, spp=100), 0.0)
    assert is_worth_tiles(after(4, 0.1, spp=100), 0.0)
    assert not is_worth_tiles(after(4, 0.1, spp=int(LONG / 0.1)), 0.0)
    assert not is_worth_tiles(after(4, 0.01, time=3.0), 0.0)
    assert is_worth_tiles(Progress(Target(spp=16)), SECONDS_BEFORE)
    assert is_worth_tiles(Progress(Target(spp=16)), 0.0, LONG)  # other pictures have taken long
    assert not is_worth_tiles(Progress(Target(spp=16)), 0.0, LONG / 2)
    assert not is_worth_tiles(Progress(Target(spp=1)), 0.0, 10 * LONG)
    assert not is_worth_tiles(Progress(Target(spp=1)), 10 * SECONDS_BEFORE)  # a window shows each sample


@pytest.mark.parametrize(
    ("home", "name"), [(MultipleImportanceSampling, "reflected"), (EnvironmentLight, "sample_direction")]
)
def test_a_replaced_step_of_mis_runs(scene, monkeypatch, home, name):
    """What tiles do in another way is asked of the method again if somebody assigns one."""
    renderer = tt.A2Renderer(scene, 16, 16).use("mis")
    assert can_take_tiles(renderer, renderer.kernel_scene(), renderer.active)
    monkeypatch.setattr(home, name, lambda *_: None)
    renderer = tt.A2Renderer(scene, 16, 16).use("mis")
    assert not can_take_tiles(renderer, renderer.kernel_scene(), renderer.active)
