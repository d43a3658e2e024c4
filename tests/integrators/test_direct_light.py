"""Direct illumination against closed forms: means and variances of one sample, furnaces, agreement of the estimators.

Significance: every z is that of a mean over thousands of pixels, and must stay within 4.5 (p = 7e-6 each, two-sided).
"""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light
from shapes import SQUARE, sphere, with_spheres
from support import DEBUG, long_except

import taichi_tracer as tt
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.geometry import Mesh
from taichi_tracer.integrators.direct_light import (
    BrdfSampling,
    DirectLight,
    EnvironmentSampling,
    MultipleImportanceSampling,
)
from taichi_tracer.materials import Material
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.sampler import UniformSampler

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


DIFFUSE_VARIANCE = {"uniform": 5 / 3, "hemisphere": 1 / 3, "brdf": 0.0}
LONG = ("hemisphere", "environment", "mis_balance")  # these repeat what the other estimators test


@pytest.mark.long
@pytest.mark.parametrize(
    "estimator", [pytest.param(n, marks=pytest.mark.long) if n in LONG else n for n in A2Renderer.names()]
)
def test_diffuse_wall_under_constant_light(wall, estimator):
    """Mean ρL; variance of a sample (5/3)(ρL)² uniform, (1/3)(ρL)² hemisphere, 0 by BRDF."""
    expected = KD * 1.5
    variance = DIFFUSE_VARIANCE.get(estimator)
    check(wall(estimator, 1.0), expected, None if variance is None else variance * expected**2)


@pytest.mark.long
@pytest.mark.parametrize("ns", long_except([2.0, 20.0], 20.0))
@pytest.mark.parametrize("estimator", long_except(A2Renderer.names(), "brdf", "mis"))
def test_phong_wall_at_normal_incidence(wall, estimator, ns):
    """Mean ρL(α+1)/(α+2), and the variances that follow from the second moments."""
    mean = KD * 1.5 * (ns + 1) / (ns + 2)
    variance = None
    if estimator == "uniform":
        variance = 2 * (KD * 1.5) ** 2 * (ns + 1) ** 2 / (2 * ns + 3) - mean**2
    elif estimator == "brdf":
        variance = (KD * 1.5) ** 2 * ((ns + 1) / (ns + 3) - ((ns + 1) / (ns + 2)) ** 2)
    check(wall(estimator, ns), mean, variance)


@pytest.mark.long
@pytest.mark.parametrize("estimator", A2Renderer.names())
def test_mirror_wall_shows_what_it_faces(wall, estimator):
    np.testing.assert_allclose(wall(estimator, 1e21).image(), np.tile(KD * 1.5, (SIZE, SIZE, 1)), rtol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("ns", long_except([1.0, 8.0, 300.0, 1e21], 8.0))
def test_furnace(ns):
    """A closed white sphere under constant light looks as the BRDF's albedo at each angle says; never above L."""
    vertices, faces = sphere(96, 49)
    normals = light.to_unit(vertices)
    mesh = Mesh(vertices, faces, normals, faces, materials=[Material(Kd=(1.0, 1.0, 1.0), Ns=ns)])
    scene = tt.SceneData(
        mesh, environment="white", view={"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.1}
    )
    image = rendered(scene, "brdf", 64, SPP, jitter=False).image()[..., 0]
    y, x = (np.mgrid[0:64, 0:64] + 0.5) / 32 - 1
    radius = np.hypot(x, y) * 1000 * np.tan(np.deg2rad(0.05))
    inside = radius < 0.9  # the silhouette of the mesh is not that of the sphere
    cosine = np.sqrt(1 - radius[inside] ** 2)
    expected = {1.0: np.ones_like(cosine), 1e21: cosine}.get(ns)
    if expected is None:
        expected = np.interp(cosine, np.linspace(0, 1, 65), light.phong_albedo(np.linspace(0, 1, 65), ns))
    assert image[inside].max() <= 1.01 + 6 / np.sqrt(SPP)
    np.testing.assert_allclose(image[inside].mean(), expected.mean(), rtol=2e-3)
    assert image[64 // 2, 64 // 2] > 0


QUICK_PAIR, LONG_PAIR = ("specular_spheres", "studio"), ("cornell_box", "studio")
PAIRS = [(s, e) for s in tt.scene_names() if "/" not in s for e in ("studio", "white")]
PAIRS = [pytest.param(*pair, marks=pytest.mark.exhaustive) for pair in PAIRS if pair not in (QUICK_PAIR, LONG_PAIR)]
PAIRS += long_except([QUICK_PAIR, LONG_PAIR])


@pytest.mark.exhaustive
@pytest.mark.parametrize(("scene", "environment"), PAIRS)
def test_every_estimator_agrees_with_every_other(scene, environment):
    """Means of the quarters of the picture, pairwise within 4.5 σ; TAICHI_TRACER_LONG=all takes every scene.

    Lobes of the plates have a millionth of all directions: so few uniform samples meet them that σ is not known.
    """
    loaded = tt.load_scene_data(scene, environment=environment)
    found = {}
    for name in set(A2Renderer.names()) - ({"uniform", "hemisphere"} if scene == "veach_plates" else set()):
        renderer = rendered(loaded, name, 32, 16 if DEBUG else 256)
        found[name] = quarters(renderer.image()), quarters(renderer.film.variance_of_mean()) / 256
    names = list(found)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            difference = np.abs(found[a][0] - found[b][0])
            spread = np.sqrt(found[a][1] + found[b][1]) + 1e-6
            assert (difference / spread).max() < LARGEST_Z, (a, b)


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


@pytest.mark.parametrize("estimator", long_except(["mis", "mis_balance", "path"], "path"))
def test_the_light_that_samples_of_the_light_leave_out_is_not_lost(estimator):
    """Three spheres under sun and sky: each quarter has the mean that samples of the light alone find."""
    scene = tt.load_scene_data("specular_spheres", environment=sky_with_sun())
    found = []
    for name in (estimator, "environment"):
        renderer_class = tt.A4Renderer if name == "path" else A2Renderer
        renderer = renderer_class(scene, 32, 32, sampler="independent").use(name)
        if name == "path":
            renderer.max_bounces = 1
        renderer.render(16 if DEBUG else 128)
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
    monkeypatch.setattr(MultipleImportanceSampling, "reflected", OnlyLights.reflected)
    assert not usual.use("mis_balance").kernel_scene().compensates


@pytest.mark.exhaustive
def test_the_suns_samplers_agree():
    """Under a sun of 2·10⁵, those that find it: the others see it once in 10⁵ samples, and know no variance of it."""
    loaded = tt.load_scene_data("specular_spheres", environment="sunny")
    a, b = (rendered(loaded, name, 32, 64) for name in ("environment", "mis"))
    spread = np.sqrt(a.film.variance_of_mean().mean(axis=(0, 1)) + b.film.variance_of_mean().mean(axis=(0, 1))) / 32
    assert (np.abs(a.image().mean(axis=(0, 1)) - b.image().mean(axis=(0, 1))) / spread).max() < LARGEST_Z


@pytest.mark.exhaustive
def test_low_discrepancy_halves_the_error():
    """At 64 samples per pixel on a smooth scene, against 4,096 of another seed."""
    scene = tt.load_scene_data("sphere", environment="studio")
    truth = A2Renderer(scene, 32, 32, seed=99).use("mis").render(256 if DEBUG else 4096).image()
    error = {}
    for name in ("sobol", "independent"):
        image = A2Renderer(scene, 32, 32, sampler=name).use("mis").render(64).image()
        error[name] = np.sqrt(((image - truth) ** 2).mean())
    assert error["independent"] > 2 * error["sobol"]


@pytest.mark.long
def test_secondary_rays_do_not_meet_their_own_surface(rng):
    """Leaving a convex mesh outwards, from sizes of 10⁻⁶ to 10⁶ and far from the origin: nothing is ever in the way."""
    for size, offset in ((1e-6, 0.0), (1e6, 0.0), (1.0, 1e3), (100.0, 1e5)):
        vertices, faces = sphere(64, 33, radius=size, centre=(offset, -offset, offset / 3))
        mesh = Mesh(vertices.astype(np.float32).astype(np.float64), faces, materials=[Material(Kd=(1.0, 1.0, 1.0))])
        scene = tt.SceneData(mesh, environment="white")
        image = rendered(scene, "brdf", 64, 16).image()
        # White albedo under white light before white sky: any self-shadow would be dark.
        np.testing.assert_allclose(image, 1, rtol=1e-5, err_msg=f"{size} {offset}")


@pytest.mark.long
def test_a_furnace_holds_a_sphere_of_its_reflectance():
    """Environment 1, reflectance 0.8, nothing occluded: radiance 0.8 everywhere on it, without any noise."""
    scene = tt.SceneData(with_spheres([(0, 0, 0, 1)]), environment="white")
    image = A2Renderer(scene, 24, 24).use("brdf").render(4).image()
    np.testing.assert_allclose(image[8:16, 8:16], 0.8, atol=2e-6)
    assert set(np.unique(image.round(5))) <= {np.float32(x) for x in (0.8, 0.85, 0.9, 0.95, 1.0)}


# ── what an estimator is made of ──


@pytest.mark.long
@pytest.mark.parametrize("name", ["environment", "mis"])
def test_a_mirror_is_sampled_once_by_its_own_direction(name):
    """No other density meets it: its picture has no noise, though two techniques make one sample."""
    vertices, faces = SQUARE
    mesh = Mesh(
        np.concatenate([vertices, vertices + [4, 0, 0]]),
        np.concatenate([faces, faces + 4]),
        face_materials=np.array([0, 0, 1, 1], np.int32),
        materials=[Material(Kd=tuple(KD), Ns=1e21), Material()],
    )
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    scene = tt.SceneData(mesh, view=view, environment=np.full((2, 4, 3), 1.5))
    image = rendered(scene, name, 12, 3).image()
    np.testing.assert_allclose(image, np.tile(KD * 1.5, (12, 12, 1)), rtol=1e-5)


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


@pytest.mark.long
def test_directions_of_ones_own_are_those_of_the_uniform_estimator():
    """With their own density: straight up, 1/2 per steradian."""

    @ti.data_oriented
    class Up(UniformSampler):
        @ti.func
        def sample_direction(self):
            return tm.vec3(0, 0, 1)

        @ti.func
        def evaluate_probability(self):
            return 0.5

    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    scene = tt.SceneData(Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))]), view=view, environment="white")
    for sampler in (Up, Up()):
        image = A2Renderer(scene, 8, 8, sampler=sampler).use("uniform").render().image()
        np.testing.assert_allclose(image, np.tile(KD / np.pi / 0.5, (8, 8, 1)), rtol=1e-5)


@pytest.mark.long
def test_only_light_that_is_there_takes_random_numbers():
    """A scene that is dark but for its emitters compiles no reflection: the rest is the emission itself."""
    mesh = Mesh(*SQUARE, materials=[Material(Kd=tuple(KD), Ke=(3.0, 2.0, 1.0))])
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    image = A2Renderer(tt.SceneData(mesh, view=view), 8, 8).use("uniform").render().image()
    np.testing.assert_array_equal(image, np.tile(np.float32([3, 2, 1]), (8, 8, 1)))
    lit = A2Renderer(tt.SceneData(mesh, view=view, environment="white"), 8, 8).use("brdf").render().image()
    np.testing.assert_allclose(lit, np.tile(np.array([3, 2, 1]) + KD, (8, 8, 1)), rtol=1e-5)


@ti.data_oriented
class WithoutNumbers(BrdfSampling):
    """Draws its random numbers itself, as the handout does."""

    name = "without_numbers"

    @ti.func
    def sample(self, scene, surface):
        w_i = surface.sample(tm.vec2(ti.random(), ti.random()))
        return w_i, surface.weight(w_i)


@pytest.mark.long
def test_an_estimator_of_your_own_need_not_take_random_numbers():
    scene = tt.load_scene_data("sphere", environment="white")
    found, expected = (
        tt.A2Renderer(scene, 16, 16).use(one).render(64).image().mean() for one in (WithoutNumbers(), "brdf")
    )
    assert found == pytest.approx(expected, rel=1e-3)  # the light is the same from everywhere


class CountedTwice(MultipleImportanceSampling):
    """Gives both kinds of samples all of the light."""

    @ti.func
    def heuristic(self, pdf, other):
        return 1.0


def test_the_heuristic_of_ones_own_weights_the_picture_and_what_is_explained_of_it():
    view = {"eye": (0, 0, 1000), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 0.05}
    scene = tt.SceneData(Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))]), view=view, environment="white")
    renderer = tt.A3Renderer(scene, 16, 16).use(CountedTwice("twice", "Twice", 2))
    renderer.render(64)
    np.testing.assert_allclose(renderer.image().mean(axis=(0, 1)), 2 * KD, rtol=0.02)
    assert [term.factors["MIS weight"] for term in renderer.explain(8, 8).terms[1:]] == [1.0, 1.0]
