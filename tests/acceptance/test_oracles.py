"""Cameras, BRDFs, warps and environments beside their formulas in float64 (``tests/oracles``)."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import cameras, light, microfacets

import taichi_tracer as tt

VIEW = {"eye": (1.0, 2.0, -4.0), "at": (0.0, 0.5, 0.0), "up": (0.0, 1.0, 0.2)}
WINDOW = {"screen_window": (-2, 2, -1, 1)}
COUNT = 20_000
Rows = ti.types.ndarray(ndim=2)


@pytest.mark.parametrize(
    ("kind", "shape", "of_oracle", "handedness"),
    [
        (tt.Camera, {"fov": 50}, {"fovy": 50}, "left"),
        (tt.Camera, {"fov": 50}, {"fovy": 50}, "right"),
        (tt.OrthographicCamera, WINDOW, WINDOW, "left"),
    ],
)
def test_rays_of_a_camera(kind, shape, of_oracle, handedness):
    camera = kind(12, 8, **VIEW, **shape, handedness=handedness)
    x, y = np.meshgrid(np.arange(12), np.arange(8))
    origins, directions = camera.rays(x.ravel(), y.ravel())
    place = (12, 8, VIEW["eye"], VIEW["at"], VIEW["up"], handedness)
    o, d = cameras.rays(kind.name, *place, **of_oracle)
    assert np.allclose(origins, o.reshape(-1, 3), atol=1e-5)
    assert np.allclose(directions, d.reshape(-1, 3), atol=1e-5)


@ti.dataclass
class Surface:
    """What the methods of the handouts read of a material."""

    Kd: tm.vec3
    F0: tm.vec3
    Ns: float
    alpha_x: float
    alpha_y: float


@ti.kernel
def values(brdf: ti.template(), surface: ti.template(), w_o: Rows, w_i: Rows, out: Rows):
    """f_r, f_r cos/pdf and pdf of pairs of directions about the normal z."""
    for i in range(w_o.shape[0]):
        o, to = tm.vec3(w_o[i, 0], w_o[i, 1], w_o[i, 2]), tm.vec3(w_i[i, 0], w_i[i, 1], w_i[i, 2])
        n = tm.vec3(0, 0, 1)
        f = brdf.evaluate_brdf(surface[None], o, to, n)
        factor = brdf.evaluate_brdf_factor(surface[None], o, to, n)
        for k in ti.static(range(3)):
            out[i, k] = f[k]
            out[i, 3 + k] = factor[k]
        out[i, 6] = brdf.evaluate_probability(surface[None], o, to, n)


@ti.kernel
def samples(brdf: ti.template(), surface: ti.template(), out: Rows):
    """Directions for the viewer (0.6, 0, 0.8)."""
    for i in range(out.shape[0]):
        w = brdf.sample_direction(surface[None], tm.vec3(0.6, 0, 0.8), tm.vec3(0, 0, 1))
        for k in ti.static(range(3)):
            out[i, k] = w[k]


@ti.kernel
def sphere_samples(out: Rows):
    """Directions, and their density."""
    for i in range(out.shape[0]):
        w = tt.UniformSampler.sample_direction()
        for k in ti.static(range(3)):
            out[i, k] = w[k]
        out[i, 3] = tt.UniformSampler.evaluate_probability()


def surface(**members):
    """A field with one surface."""
    field = Surface.field(shape=())
    field[None] = Surface(**members)
    return field


def directions(count=COUNT):
    """Pairs of directions above the surface, not along it."""
    rng = np.random.default_rng(8)
    pairs = [light.hemisphere(rng, count) for _ in range(2)]
    clear = (pairs[0][:, 2] > 0.05) & (pairs[1][:, 2] > 0.05)
    return [pair[clear].astype(np.float32) for pair in pairs]


KD, F0 = (0.2, 0.5, 0.8), (0.9, 0.6, 0.3)


@pytest.mark.parametrize("ns", [1.0, 12.0])
def test_the_diffuse_and_the_glossy_brdf(ns):
    w_o, w_i = directions()
    found = np.zeros((len(w_o), 7), np.float32)
    values(tt.BRDF, surface(Kd=KD, Ns=ns), w_o, w_i, found)
    mirrored = w_o * [-1, -1, 1]
    lobe = np.maximum((mirrored * w_i).sum(1), 0) if ns > 1 else w_i[:, 2]
    pdf = (ns + 1) / (2 * np.pi) * lobe**ns
    f = np.outer(pdf if ns > 1 else np.full(len(pdf), 1 / np.pi), KD)
    assert np.allclose(found[:, :3], f, rtol=1e-3, atol=1e-5)
    assert np.allclose(found[:, 6], pdf, rtol=1e-3, atol=1e-5)
    inside = pdf > 0
    factor = np.outer(w_i[:, 2] if ns > 1 else np.ones(len(pdf)), KD)
    assert np.allclose(found[inside, 3:6], factor[inside], rtol=1e-4)


def test_microfacets():
    w_o, w_i = directions()
    found = np.zeros((len(w_o), 7), np.float32)
    values(tt.MicrofacetBRDF, surface(F0=F0, alpha_x=0.4, alpha_y=0.2), w_o, w_i, found)
    f, pdf, weight = microfacets.parts((0.4, 0.2), F0, w_o.astype(float), w_i.astype(float))
    # Which axes α_x and α_y belong to is a choice about the normal: x and y, or y and x.
    other = microfacets.parts((0.2, 0.4), F0, w_o.astype(float), w_i.astype(float))
    rows = (f, pdf, weight) if np.allclose(found[:, 6], pdf, rtol=2e-2, atol=1e-3) else other
    assert np.allclose(found[:, :3], rows[0], rtol=1e-2, atol=1e-4)
    assert np.allclose(found[:, 6], rows[1], rtol=1e-2, atol=1e-4)
    assert np.allclose(found[:, 3:6], rows[2], rtol=1e-2, atol=1e-4)


def is_uniform(values) -> bool:
    """Whether values are uniform in [0, 1): Kolmogorov's distance; 2.4/√n is exceeded with a probability of 2e-5."""
    ordered, n = np.sort(values), len(values)
    ranks = np.arange(n) / n
    return max(abs(ordered - ranks).max(), abs(ordered - ranks - 1 / n).max()) < 2.4 / np.sqrt(n)


def test_directions_that_are_uniform_on_the_sphere():
    found = np.zeros((COUNT, 4), np.float32)
    sphere_samples(found)
    assert np.allclose(np.linalg.norm(found[:, :3], axis=1), 1, atol=1e-5)
    assert np.allclose(found[:, 3], 1 / (4 * np.pi))
    assert is_uniform((found[:, 2] + 1) / 2)
    assert is_uniform(np.arctan2(found[:, 1], found[:, 0]) / (2 * np.pi) + 0.5)


@pytest.mark.parametrize("ns", [1.0, 12.0])
def test_directions_that_follow_the_brdf(ns):
    """(ω·axis)^(α + 1) is uniform: the axis is n for α = 1, and ω_r for a larger one."""
    found = np.zeros((COUNT, 3), np.float32)
    samples(tt.BRDF, surface(Kd=KD, Ns=ns), found)
    axis = np.array([-0.6, 0, 0.8]) if ns > 1 else np.array([0, 0, 1.0])
    assert np.allclose(np.linalg.norm(found, axis=1), 1, atol=1e-5)
    assert is_uniform((found @ axis) ** (ns + 1))


def test_the_environment_behind_everything():
    sky = np.random.default_rng(4).uniform(0, 3, (5, 9, 3))
    scene = tt.scene_from_mesh([[0, -50, 0], [1e-3, -50, 0], [0, -50, 1e-3]], [[0, 1, 2]], environment=sky)
    renderer = tt.A2Renderer(scene_data=scene, width=40, height=30, jitter=False)
    renderer.camera.set_camera_parameters(eye=(0, 0, 0), at=(0.3, 0.2, 1), up=(0, 1, 0), fov=120)
    image = np.asarray(renderer.use("brdf").render(1).image())
    x, y = np.meshgrid(np.arange(40), np.arange(30))
    right = light.lookup(sky, renderer.camera.rays(x.ravel(), y.ravel())[1]).reshape(30, 40, 3)[::-1]
    assert (abs(image - right).max(-1) < 1e-5).mean() > 0.98
