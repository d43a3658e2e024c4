"""Samples taken tile by tile: the same bits as pixel by pixel, and only where that is certain."""

import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.fast.tiles import can_take_tiles
from taichi_tracer.integrators.direct_light import BrdfSampling, MultipleImportanceSampling
from taichi_tracer.lights.environment_light import EnvironmentLight

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def scene():
    return tt.load_scene_data("specular_spheres", environment="sunny")


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
