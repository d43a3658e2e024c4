"""All lights together: far ones add up and share the samples, single ones are sampled each, and walls hide both."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light as oracle
from probe import put, vec3
from shapes import SQUARE

import taichi_tracer as tt
from taichi_tracer.formulas.warps import uniform_sphere
from taichi_tracer.geometry import Mesh
from taichi_tracer.lights.base import Light
from taichi_tracer.materials import Material
from taichi_tracer.ray import Ray, no_hit
from taichi_tracer.ray_intersector import BruteForceRayIntersector
from taichi_tracer.renderer import A2Renderer

KD = np.array([0.8, 0.5, 0.2])

pytestmark = pytest.mark.usefixtures("f32")


@ti.data_oriented
class Point(Light):
    """I / d² from one point."""

    name, is_delta = "point", True

    def __init__(self, place, intensity):
        self.place, self.intensity = tuple(map(float, place)), tuple(map(float, intensity))

    @ti.func
    def sample(self, x, xi):
        to_light = tm.vec3(self.place) - x
        distance = to_light.norm()
        return to_light / distance, distance, tm.vec3(self.intensity) / distance**2, 1.0


@ti.data_oriented
class Half(Light):
    """One colour from all directions with y > 0, sampled uniformly on the whole sphere."""

    name, is_far = "half", True

    def __init__(self, color):
        self.color = tuple(map(float, color))

    @ti.func
    def sample(self, x, xi):
        w = uniform_sphere(xi)
        return w, tm.inf, self.along(w), 1 / (4 * tm.pi)

    @ti.func
    def pdf(self, x, w_i, hit):
        return 1 / (4 * tm.pi)

    @ti.func
    def radiance(self, ray, hit):
        value = tm.vec3(0)
        if not hit.is_hit:
            value = self.along(ray.direction)
        return value

    @ti.func
    def along(self, w):
        return ti.select(w.y > 0, tm.vec3(self.color), tm.vec3(0))


def lit_square(**options):
    """A white-ish square at z = 0 that faces +z, seen from above."""
    mesh = Mesh(*SQUARE, materials=[Material(Kd=tuple(KD))])
    view = {"eye": (0, 0, 4), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 20.0}
    return tt.SceneData(mesh, view=view, **options)


# ── which lights there are ──


def test_far_lights_are_those_that_rays_can_see():
    scene = lit_square(environment="studio", lights=[Point((0, 0, 1), (1, 1, 1)), Half((1, 0, 0))])
    lights = scene.in_kernels().lights
    assert [light.name for light in lights.far] == ["environment", "half"]
    assert [light.name for light in lights.single] == ["point"]
    assert scene.in_kernels().effects.lights == ("point", "half")
    for environment in (None, "black"):
        assert lit_square(environment=environment).in_kernels().lights.far == ()


@ti.kernel
def _far(lights: ti.template(), xi: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(xi.shape[0]):
        x = tm.vec3(0, 0, 1)
        w, distance, light, pdf = lights.sample(x, tm.vec3(0, 0, 1), tm.vec2(xi[i, 0], xi[i, 1]))
        put(out, i, 0, w)
        out[i, 3], out[i, 4] = pdf, lights.pdf(x, tm.vec3(0, 0, 1), w, no_hit())
        put(out, i, 5, lights.arriving(Ray(origin=x, direction=w), no_hit()))


def far_samples(scene, count=100_000):
    lights = scene.in_kernels().lights
    lights.prepare()
    xi = np.random.default_rng(8).random((count, 2)).astype(np.float32)
    out = np.zeros((count, 8), np.float32)
    _far(lights, xi, out)
    return out.astype(float)


def test_far_lights_add_up_and_share_the_samples():
    """Each is asked in half of the cases; the density is that of both together; the mean is ∫ L dω (z < 4.5)."""
    image = np.zeros((8, 16, 3))
    image[2, 3] = (40.0, 30.0, 20.0)
    scene = lit_square(environment=image, lights=[Half((0.25, 0.5, 1.0))])
    out = far_samples(scene)
    w, pdf, told, seen = out[:, :3], out[:, 3], out[:, 4], out[:, 5:]
    np.testing.assert_array_equal(pdf, told)
    sky = oracle.lookup(image, w)
    upper = np.where(w[:, 1:2] > 0, [0.25, 0.5, 1.0], 0)
    assert np.isclose(seen, sky + upper, rtol=1e-5).all(axis=1).mean() > 0.999
    solid_angle = 2 * np.pi / 16 * (np.cos(np.pi * 2 / 8) - np.cos(np.pi * 3 / 8))
    exact = image[2, 3] * solid_angle + 2 * np.pi * np.array([0.25, 0.5, 1.0])
    estimates = seen / pdf[:, None]
    z = (estimates.mean(axis=0) - exact) / (estimates.std(axis=0) / np.sqrt(len(pdf)))
    assert np.abs(z).max() < 4.5
    by_image = sky[:, 0] > 0
    assert by_image.mean() > 0.5  # half of the samples, and those of the other light that happen to fall there
    np.testing.assert_allclose(pdf[~by_image], 0.5 / (4 * np.pi), rtol=1e-5)
    np.testing.assert_allclose(
        pdf[by_image & (np.abs(w[:, 1]) < 0.6)], 0.5 / (4 * np.pi) + 0.5 / solid_angle, rtol=1e-4
    )


def test_lamps_and_far_lights_share_the_samples():
    """What is left of the first number after the choice is uniform: far directions are those of a sphere (z < 4.5)."""
    mesh = Mesh(*SQUARE, materials=[Material(Kd=tuple(KD), Ke=(1.0, 1.0, 1.0))])
    scene = tt.SceneData(mesh, view={"eye": (0, 0, 4), "at": (0, 0, 0), "up": (0, 1, 0)}, lights=[Half((1, 1, 1))])
    share, out = scene.in_kernels().lights.far_share, far_samples(scene)
    is_far = np.isclose(out[:, 3], share / (4 * np.pi), rtol=1e-5)
    assert 0 < share < 1
    assert is_far.mean() == pytest.approx(share, abs=4.5 * 0.5 / np.sqrt(len(out)))
    w = out[is_far, :3]
    assert np.abs(w.mean(axis=0) / np.sqrt(1 / 3 / len(w))).max() < 4.5
    assert (out[~is_far, 2] < 0).all()  # the lamp is below


# ── what hides a light ──


@ti.kernel
def _visible(scene: ti.template(), w: ti.types.ndarray(ndim=2), factor: float, out: ti.types.ndarray(ndim=2)):
    for i in range(w.shape[0]):
        ray = Ray(origin=tm.vec3(0.1, 0.2, 0.5), direction=tm.vec3(0, 0, -1))
        surface = scene.surface_at(ray, scene.ray_intersector.query_ray(ray))
        put(out, i, 0, scene.visible_radiance(surface, vec3(w, i, 0), tm.vec3(factor)))


def visible(scene, directions, factor=1.0):
    out = np.zeros((len(directions), 3), np.float32)
    _visible(scene.in_kernels(), np.ascontiguousarray(directions, np.float32), factor, out)
    return out


def test_a_light_is_hidden_by_what_is_in_the_way():
    """A roof over half of the square, one unit above it; the point that is lit lies at (0.1, 0.2, 0)."""
    roof = np.array([[0, -1, 1], [1, -1, 1], [1, 1, 1], [0, 1, 1.0]])
    mesh = Mesh(np.concatenate([SQUARE[0], roof]), np.concatenate([SQUARE[1], SQUARE[1] + 4]))
    scene = tt.SceneData(mesh, environment=np.full((1, 1, 3), 2.0))
    directions = oracle.to_unit(np.array([[0, 0, 1], [0.1, 0, 1], [-0.5, 0, 1], [0, 0.3, -1.0]]))
    assert visible(scene, directions)[:, 0].tolist() == [0, 0, 2, 0]  # roof, roof, sky, below the surface


# ── the last ray of a path ──


@ti.kernel
def _last_rays(scene: ti.template(), o: ti.types.ndarray(ndim=2), d: ti.types.ndarray(ndim=2), out: ti.types.ndarray()):
    for i in range(o.shape[0]):
        ray = Ray(origin=vec3(o, i, 0), direction=vec3(d, i, 0))
        hit = scene.ray_intersector.query_ray(ray)
        out[i, 0] = ti.cast(scene.may_find_light(ray), ti.i32)
        out[i, 1] = ti.cast(scene.lights.arriving(ray, hit).max() > 0, ti.i32)


def last_rays(scene, origins, directions):
    """(whether rays may find light, whether they find some), bool."""
    out = np.zeros((len(origins), 2), np.int32)
    _last_rays(scene.in_kernels(), *(np.ascontiguousarray(a, np.float32) for a in (origins, directions)), out)
    return out.T.astype(bool)


@pytest.mark.parametrize("name", ["veach_plates"])
def test_what_may_find_no_light_finds_none(name):
    """The rays leave all surfaces; some go through the corners, along the edges and in the planes of the lamps."""
    rng, scene = np.random.default_rng(3), tt.load_scene_data(name)
    mesh, table = scene.mesh, scene.lamps.table
    corners = mesh.vertices[mesh.faces[rng.integers(len(mesh.faces), size=20_000)]]
    origins = (rng.dirichlet([1, 1, 1], len(corners))[:, :, None] * corners).sum(axis=1)
    of_lamps = mesh.vertices[mesh.faces[table.primitives[table.primitives >= 0]]].reshape(-1, 3)
    if len(of_lamps) == 0:
        of_lamps = (table.low + table.high) / 2
    directions = rng.normal(size=origins.shape)
    directions[::2] = of_lamps[rng.integers(len(of_lamps), size=len(origins[::2]))] - origins[::2]
    origins[::3, 1] = of_lamps[rng.integers(len(of_lamps), size=len(origins[::3])), 1]
    may_find, finds = last_rays(scene, origins, directions)
    assert finds.sum() > 100
    assert not (finds & ~may_find).any()
    if name == "cornell_box":
        assert may_find[1::2].mean() < 0.3


def test_where_a_student_finds_what_a_ray_hits_it_may_be_a_lamp_anywhere():
    class Mine(BruteForceRayIntersector):
        @ti.func
        def intersect_triangle(self, ray, triangle_id):
            return no_hit()

    directions = np.random.default_rng(4).normal(size=(100, 3))
    scene = tt.load_scene_data("cornell_box", intersector=Mine)
    may_find, finds = last_rays(scene, np.zeros((100, 3)) + [0, 1, 0], directions)
    assert may_find.all()
    assert not finds.any()


def test_light_from_far_away_may_always_be_found_and_a_point_light_never():
    directions = np.random.default_rng(4).normal(size=(100, 3))
    for lights, expected in (([Half((1, 2, 3))], True), ([Point((0, 0, 1), (1, 1, 1))], False)):
        may_find, _ = last_rays(lit_square(lights=lights), np.zeros((100, 3)) + [0, 0, 1], directions)
        assert (may_find == expected).all()


# ── lights that are sampled one by one, in pictures ──


@pytest.mark.parametrize("estimator", ["mis"])
def test_a_point_light_is_the_closed_form_in_every_estimator(estimator):
    """Kd/π I cos θ / d²: without noise, and the same for all, though no ray meets it."""
    place = np.array([0.3, -0.2, 1.5])
    scene = lit_square(lights=[Point(place, (3, 2, 1))])
    renderer = A2Renderer(scene, 8, 8, jitter=False).use(estimator)
    image = renderer.render(2).image().astype(float)[::-1]
    tangent = np.tan(np.deg2rad(10))
    ndc = 2 * (np.arange(8) + 0.5) / 8 - 1
    x, y = np.meshgrid(-4 * tangent * ndc, 4 * tangent * ndc)  # the courses' frame shows the world mirrored (C-5)
    to_light = place - np.stack([x, y, np.zeros((8, 8))], axis=2)
    d2 = (to_light**2).sum(axis=2)
    expected = KD / np.pi * np.array([3, 2, 1]) * (to_light[..., 2] / d2**1.5)[..., None]
    np.testing.assert_allclose(image, expected, rtol=2e-5)
