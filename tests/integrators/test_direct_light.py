"""Direct illumination against closed forms: means and variances of one sample, furnaces, agreement of the estimators.

Significance: every z is that of a mean over thousands of pixels, and must stay within 4.5 (p = 7e-6 each, two-sided).
"""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE
from support import DEBUG

import taichi_tracer as tt
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.geometry import Mesh
from taichi_tracer.integrators.direct_light import (
    DirectLight,
    EnvironmentSampling,
    MultipleImportanceSampling,
)
from taichi_tracer.materials import Material
from taichi_tracer.renderer import A2Renderer

LARGEST_Z = 4.5
KD = np.array([0.8, 0.5, 0.2])
SIZE, SPP = (16, 64) if DEBUG else (48, 256)

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def wall():
    """A square seen from so far that every ray meets it at a right angle, with nothing in the light's way.

    All BRDFs are compiled in, and ``wall(estimator, ns)`` gives it one: each estimator is compiled once.
    """
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    mesh = Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))])
    scene = tt.SceneData(mesh, view=view, environment=np.full((2, 4, 3), 1.5), effects="all")
    library, renderers = scene.material_library, {}

    def render(estimator, ns):
        material = Material(Kd=tuple(KD), Ns=ns)
        (library.brdf_ids[0, 0],) = [i for i, b in enumerate(library.brdfs) if b.describes(material, np.float32)]
        for column, value in enumerate(library.as_table([material])[0]):
            library.table[0, column] = value
        if estimator not in renderers:
            renderers[estimator] = A2Renderer(scene, SIZE, SIZE, sampler="independent").use(estimator)
        renderers[estimator].reset()
        return renderers[estimator].render(SPP)

    return render


def rendered(scene, estimator, size=SIZE, spp=SPP, **options):
    options.setdefault("sampler", "independent")
    renderer = A2Renderer(scene, size, size, **options).use(estimator)
    renderer.render(spp)
    assert renderer.non_finite == 0
    return renderer


def check(renderer, mean, variance=None):
    """z-tests of the mean over all samples, and of the variance of one sample."""
    n = renderer.samples
    per_pixel = renderer.film.variance_of_mean() * n
    pixels = per_pixel.shape[0] * per_pixel.shape[1]
    image = renderer.image().astype(np.float64)
    spread = np.sqrt(per_pixel.mean(axis=(0, 1)) / n / pixels) + 2e-7 * np.abs(mean)
    assert (np.abs(image.mean(axis=(0, 1)) - mean) / spread).max() < LARGEST_Z
    if variance is not None:
        spread = per_pixel.std(axis=(0, 1)) / np.sqrt(pixels) + 1e-6 * mean**2
        assert (np.abs(per_pixel.mean(axis=(0, 1)) - variance) / spread).max() < LARGEST_Z


def quarters(image):
    """Means of the four quarters of a 32 × 32 picture, (2, 2, 3)."""
    return image.astype(np.float64).reshape(2, 16, 2, 16, 3).mean(axis=(1, 3))


# ── compensation ──


@ti.data_oriented
class SeesOneSide(Diffuse):
    """Diffuse, but that its own samples go only to the side of +x: its pdf is 0 on the other."""

    name, reaches_all = "one side", False

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        return ti.select(w_i.x < 0, 0.0, 2 * Diffuse.pdf(self, material, w_o, w_i, n))

    @ti.func
    def sample(self, material, w_o, n, xi):
        w_i = Diffuse.sample(self, material, w_o, n, xi)
        return tm.vec3(abs(w_i.x), w_i.y, w_i.z)

    @ti.func
    def weight(self, material, w_o, w_i, n):
        return material.Kd / 2


@ti.data_oriented
class OnlyLights(MultipleImportanceSampling):
    """A student's estimator that takes the light's sample alone."""

    reflected = EnvironmentSampling.reflected


def sky_with_sun():
    """(16, 32, 3): an even sky, and a sun that has half of the light."""
    sky = np.full((16, 32, 3), 0.4)
    sky[4:6, 23:25] = 60
    return sky


@pytest.mark.parametrize("estimator", ["path"])
def test_the_light_that_samples_of_the_light_leave_out_is_not_lost(estimator):
    """Three spheres under sun and sky: each quarter has the mean that samples of the light alone find."""
    scene = tt.load_scene_data("specular_spheres", environment=sky_with_sun())
    found = []
    for name in (estimator, "environment"):
        renderer_class = tt.A4Renderer if name == "path" else A2Renderer
        renderer = renderer_class(scene, 32, 32, sampler="independent").use(name)
        if name == "path":
            renderer.max_bounces = 1
        renderer.render(16 if DEBUG else 64)
        assert renderer.kernel_scene().compensates == (name != "environment")
        found.append((quarters(renderer.image()), quarters(renderer.film.variance_of_mean()) / 256))
    (image, variance), (expected, variance_of_lights) = found
    assert (np.abs(image - expected) / (np.sqrt(variance + variance_of_lights) + 1e-6)).max() < LARGEST_Z


def test_leaving_out_the_even_light_makes_the_picture_less_noisy(monkeypatch):
    """A wall in the sun: the variance is less than a tenth of that without compensation (measured: a hundredth)."""
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    scene = tt.SceneData(Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))]), view=view, environment=sky_with_sun())
    compensated = rendered(scene, "mis", 16, 64).film.variance_of_mean().mean()
    monkeypatch.setattr(MultipleImportanceSampling, "compensates", property(lambda self: False))
    usual = rendered(scene, "mis", 16, 64)
    assert not usual.kernel_scene().compensates
    assert compensated < 0.1 * usual.film.variance_of_mean().mean()


def test_nothing_is_left_out_that_a_brdf_does_not_find():
    """MIS allows a BRDF whose samples miss directions, as long as the light's samples do not leave them out."""
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    mesh = Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))])
    scene = tt.SceneData(mesh, view=view, environment=sky_with_sun(), brdfs=[SeesOneSide()])
    own = rendered(scene, "mis", 16, SPP)
    assert not own.kernel_scene().compensates
    usual = rendered(tt.SceneData(mesh, view=view, environment=sky_with_sun()), "mis", 16, SPP)
    assert usual.kernel_scene().compensates
    means = [r.image().astype(np.float64).mean(axis=(0, 1)) for r in (own, usual)]
    spread = np.sqrt(sum(r.film.variance_of_mean().mean(axis=(0, 1)) for r in (own, usual))) / 16
    assert (np.abs(means[0] - means[1]) / spread).max() < LARGEST_Z


def test_a_students_estimator_gets_samples_of_all_light(monkeypatch):
    scene = tt.load_scene_data("specular_spheres", environment=sky_with_sun())
    own = rendered(scene, OnlyLights("only_lights", "only lights", 2), 32, 64)
    assert not own.kernel_scene().compensates
    usual = rendered(scene, "mis", 32, 64)
    spread = np.sqrt(sum(r.film.variance_of_mean().mean(axis=(0, 1)) for r in (own, usual))) / 32
    assert (np.abs(own.image().mean(axis=(0, 1)) - usual.image().mean(axis=(0, 1))) / spread).max() < LARGEST_Z
    assert usual.use("mis_balance").kernel_scene().compensates
    monkeypatch.setattr(MultipleImportanceSampling, "reflected", OnlyLights.reflected)
    assert not usual.use("mis_balance").kernel_scene().compensates


@ti.data_oriented
class Upwards(DirectLight):
    """An estimator of a user's own: always along the normal, with a made-up density of 1."""

    name = "upwards"

    @ti.func
    def sample(self, scene, surface, xi):
        return surface.normal, surface.eval_cosine(surface.normal)


def test_an_estimator_says_one_direction_and_what_its_light_is_worth():
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    scene = tt.SceneData(Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))]), view=view, environment="white")
    image = A2Renderer(scene, 8, 8).use(Upwards()).render(2).image()
    np.testing.assert_allclose(image, np.tile(KD / np.pi, (8, 8, 1)), rtol=1e-5)


def test_an_estimator_without_a_sample_is_asked_for_one_by_name():
    @ti.data_oriented
    class Unfinished(DirectLight):
        name = "unfinished"

    scene = tt.SceneData(Mesh(*SQUARE), environment="white")
    with pytest.raises(Exception, match=r"an estimator must say what sample\(self, scene, surface, ...\) is"):
        A2Renderer(scene, 8, 8).use(Unfinished()).render()


class CountedTwice(MultipleImportanceSampling):
    """Gives both kinds of samples all of the light."""

    @ti.func
    def heuristic(self, pdf, other):
        return 1.0


@pytest.mark.slow
def test_the_heuristic_of_ones_own_weights_the_picture_and_what_is_explained_of_it():
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    scene = tt.SceneData(Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))]), view=view, environment="white")
    renderer = tt.A3Renderer(scene, 16, 16).use(CountedTwice("twice", "Twice", 2))
    renderer.render(64)
    np.testing.assert_allclose(renderer.image().mean(axis=(0, 1)), 2 * KD, rtol=0.02)
    assert [term.factors["MIS weight"] for term in renderer.explain(8, 8).terms[1:]] == [1.0, 1.0]
