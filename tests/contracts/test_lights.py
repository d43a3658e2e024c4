"""Every registered light, and that of environments, keeps its contract; those that break it in one point are found."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import lights
from taichi_tracer.contracts.statistics import SphereCells
from taichi_tracer.contracts.steps import environment_and_checks

pytestmark = pytest.mark.usefixtures("f32")


def check_light(light, cells=None):
    """All that a light must do; ``cells`` as for ``lights.Bench``."""
    bench = lights.Bench(light, cells=cells)
    for step in lights.steps(light):
        step(bench)
    lights.check_facts(bench)


@every("light")
def test_light(part):
    if not (part.is_far or part.is_delta or part.is_ambient):
        pytest.skip(f"rays meet {part.name}: check_light needs a scene that contains it")
    check_light(part)


def test_environments():
    """An image with a bright spot, turned; and one that is interpolated."""
    image = np.random.default_rng(5).random((32, 64, 3))
    image[5, 9] = 300
    for options in ({"rotation": 90.0, "intensity": 3.0}, {"lookup": "bilinear"}):

        def environment(options=options):
            return tt.Environment(image, **options)

        bench, checks = environment_and_checks(environment)
        for check in checks:
            check(bench)


# ── lights for the tests: half a sky and a lamp, both right, and what can be wrong with them ──


@ti.data_oriented
class HalfSky(tt.Light):
    """Light of the upper half of the sky, of radiance 2."""

    name, is_far = "half a sky", True

    @ti.func
    def sample(self, x, xi):
        r = ti.sqrt(1 - xi.x * xi.x)
        w_i = tm.vec3(r * ti.cos(2 * tm.pi * xi.y), xi.x, r * ti.sin(2 * tm.pi * xi.y))
        return w_i, tm.inf, tm.vec3(2), 1 / (2 * tm.pi)

    @ti.func
    def pdf(self, x, w_i, hit):
        return ti.select(w_i.y >= 0, 1 / (2 * tm.pi), 0.0)

    @ti.func
    def radiance(self, ray, hit):
        return tm.vec3(ti.select(ray.direction.y >= 0 and not hit.is_hit, 2.0, 0.0))


@ti.data_oriented
class Lamp(tt.Light):
    """A point at (1, 2, 3)."""

    name, is_delta = "a lamp", True

    @ti.func
    def sample(self, x, xi):
        to_light = tm.vec3(1, 2, 3) - x
        distance = to_light.norm()
        return to_light / distance, distance, tm.vec3(5) / distance**2, 1.0


@ti.data_oriented
class Panel(tt.Light):
    """A square of 4 × 4 at z = 3 that shines to both sides: what rays meet, and what is sampled by its area."""

    name = "a panel"

    @ti.func
    def sample(self, x, xi):
        to_light = tm.vec3(4 * xi.x - 2, 4 * xi.y - 2, 3) - x
        distance = to_light.norm()
        w_i = to_light / distance
        return w_i, distance, tm.vec3(5), distance**2 / (16 * abs(w_i.z))

    @ti.func
    def pdf(self, x, w_i, hit):
        return ti.select(hit.is_hit, hit.distance**2 / (16 * abs(w_i.z)), 0.0)

    @ti.func
    def radiance(self, ray, hit):
        return tm.vec3(ti.select(hit.is_hit, 5.0, 0.0))


@pytest.mark.parametrize("light", [HalfSky, Lamp])
def test_right_lights_pass(light):
    cells = SphereCells.equal_angles(16, 32) if light is HalfSky else None
    check_light(light(), cells=cells)


def test_a_light_that_rays_meet_passes():
    """At points near it: the cells of the χ² test are too coarse for the edges of a square far away."""
    scene = tt.scene_from_mesh(SQUARE[0] * 2 + [0, 0, 3], SQUARE[1])
    bench = lights.Bench(Panel(), scene.ray_intersector, lights.POINTS[:2])
    lights.check_samples_are_legal(bench)
    lights.check_sample_agrees_with_values(bench)
    lights.check_sample_follows_pdf(bench)


@ti.data_oriented
class WrongNormalisation(HalfSky):
    name = "broken: pdf of the whole sphere"

    @ti.func
    def sample(self, x, xi):
        w_i, distance, radiance, _ = HalfSky.sample(self, x, xi)
        return w_i, distance, radiance, 1 / (4 * tm.pi)

    @ti.func
    def pdf(self, x, w_i, hit):
        return ti.select(w_i.y >= 0, 1 / (4 * tm.pi), 0.0)


@ti.data_oriented
class TwoDensities(HalfSky):
    name = "broken: sample and pdf disagree"

    @ti.func
    def pdf(self, x, w_i, hit):
        return ti.max(0.0, w_i.y) / tm.pi


@ti.data_oriented
class WrongDirections(HalfSky):
    """The density is uniform, the directions are close to the zenith."""

    name = "broken: samples of another density"

    @ti.func
    def sample(self, x, xi):
        return HalfSky.sample(self, x, tm.vec2(ti.sqrt(xi.x), xi.y))


@ti.data_oriented
class OtherRadiance(HalfSky):
    name = "broken: sample forgets a factor"

    @ti.func
    def radiance(self, ray, hit):
        return 0.5 * HalfSky.radiance(self, ray, hit)


@ti.data_oriented
class InfiniteRadiance(HalfSky):
    name = "broken: infinite at the horizon"

    @ti.func
    def radiance(self, ray, hit):
        return HalfSky.radiance(self, ray, hit) / abs(ray.direction.y)


@ti.data_oriented
class NearAndFar(HalfSky):
    name = "broken: far, at a finite distance"

    @ti.func
    def sample(self, x, xi):
        w_i, _, radiance, pdf = HalfSky.sample(self, x, xi)
        return w_i, 100.0, radiance, pdf


@ti.data_oriented
class SquaredDistance(Lamp):
    name = "broken: the distance squared"

    @ti.func
    def sample(self, x, xi):
        w_i, distance, radiance, pdf = Lamp.sample(self, x, xi)
        return w_i, distance * distance, radiance, pdf


@ti.data_oriented
class DensityOfAPoint(Lamp):
    name = "broken: a delta light with a density"

    @ti.func
    def sample(self, x, xi):
        w_i, distance, radiance, _ = Lamp.sample(self, x, xi)
        return w_i, distance, radiance, 1 / (4 * tm.pi)


@ti.data_oriented
class SeenByRays(Lamp):
    name = "broken: a delta light that rays see"

    @ti.func
    def radiance(self, ray, hit):
        return tm.vec3(1)


@ti.data_oriented
class AddressAsFact(Lamp):
    """What it keeps is no number, and has no text of its own."""

    name = "broken: facts that differ from run to run"

    def __init__(self):
        self.colour = object()


@broken_parts(
    {
        WrongNormalisation: "integral of pdf is 0.5",
        TwoDensities: "sample returns the pdf",
        WrongDirections: "not those of pdf",
        OtherRadiance: "sample returns the radiance",
        InfiniteRadiance: "radiance is not finite",
        NearAndFar: "distance is 100",
        SquaredDistance: "distances are wrong",
        DensityOfAPoint: "pdf of 0.0795",
        SeenByRays: "no ray sees a delta light",
        AddressAsFact: "facts differ",
    }
)
def test_broken_light_is_found(broken, reason):
    cells = SphereCells.equal_angles(16, 32)
    check_fails(broken, lambda light: check_light(light, cells=cells), reason)
