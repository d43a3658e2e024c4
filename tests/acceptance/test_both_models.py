"""The course's three spheres, whose materials have Ns and a roughness: Ns decides, except with ``microfacet``.

The pictures are compared by blocks with float64 integrals over directions, which are independent of the package.
"""

import numpy as np
import pytest
from oracles.light import lookup, to_unit
from oracles.microfacets import parts
from oracles.rays import eye_rays
from oracles.spheres import nearest

import taichi_tracer as tt

SPHERES = np.array([[-2.2, 0, 0, 1], [0, 0, 0, 1], [2.2, 0, 0, 1.0]])
NS, KD, ALPHA, F0 = (1.0, 50.0, 1e21), 0.8, (0.3, 0.2, 0.25), (0.9, 0.7, 0.5)
VIEW = {"eye": (0.0, 1.0, 9.0), "at": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0), "fov": 20.0}
WIDTH, HEIGHT, BLOCK = 48, 16, 8
DIRECTIONS, SPP, SEEDS = 1024, 32, 16


@pytest.fixture(scope="module")
def scene():
    """The spheres under the studio."""
    materials = [
        tt.Material(name=f"{ns:g}", Kd=(KD,) * 3, Ns=ns, alpha=alpha, F0=F0)
        for ns, alpha in zip(NS, ALPHA, strict=True)
    ]
    mesh = tt.Mesh(
        vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), int), spheres=SPHERES,
        sphere_materials=np.arange(3), materials=materials,
    )  # fmt: skip
    return tt.scene_from_mesh(mesh, environment="studio", view=VIEW)


def frame(n):
    """Two unit vectors that are perpendicular to n."""
    x = to_unit(np.cross(n, [0, 1, 0] if abs(n[1]) < 0.9 else [1, 0, 0]))
    return x, np.cross(n, x)


def lobe(axis, exponent, rng):
    """Directions about an axis with the density (exponent + 1)/2π cos^exponent; the axis itself for a mirror."""
    x, y = frame(axis)
    z = rng.random(DIRECTIONS) ** (1 / (exponent + 1))
    r, phi = np.sqrt(1 - z * z), 2 * np.pi * rng.random(DIRECTIONS)
    return (r * np.cos(phi))[:, None] * x + (r * np.sin(phi))[:, None] * y + z[:, None] * axis


def reflected(k, n, w_o, microfacets, rng):
    """Directions, and the factors f_r cos θ / pdf by which their light counts."""
    if microfacets:
        w_i = lobe(n, 0, rng)  # uniform on the hemisphere
        x, y = frame(n)
        local = np.stack([x, y, n], axis=1)
        f, _, _ = parts((ALPHA[k], ALPHA[k]), F0, np.broadcast_to(w_o @ local, w_i.shape), w_i @ local)
        return w_i, f * (w_i @ n)[:, None] * 2 * np.pi
    if NS[k] == 1:
        return lobe(n, 1, rng), np.full((DIRECTIONS, 3), KD)
    w_i = lobe(2 * (n @ w_o) * n - w_o, NS[k], rng)
    return w_i, np.repeat(KD * np.maximum(w_i @ n, 0)[:, None], 3, axis=1)


def expected(pixels, microfacets):
    """(blocks, their standard errors) of the picture, in float64."""
    rng = np.random.default_rng(7)
    d = eye_rays(VIEW["eye"], VIEW["at"], VIEW["up"], VIEW["fov"], WIDTH, HEIGHT).reshape(-1, 3)
    ids, t, normals, _ = nearest(np.broadcast_to(VIEW["eye"], d.shape), d, SPHERES)
    value, variance = lookup(pixels, d), np.zeros((len(d), 3))
    for i in np.flatnonzero(ids >= 0):
        w_i, factor = reflected(ids[i], normals[i], -d[i], microfacets, rng)
        x = np.asarray(VIEW["eye"]) + t[i] * d[i] + 1e-9 * normals[i]
        blocked = nearest(np.broadcast_to(x, w_i.shape), w_i, SPHERES)[0] >= 0
        light = np.where((~blocked & (w_i @ normals[i] > 0))[:, None], factor * lookup(pixels, w_i), 0)
        value[i], variance[i] = light.mean(axis=0), light.var(axis=0) / DIRECTIONS
    return blocks(value.reshape(HEIGHT, WIDTH, 3)[::-1]), np.sqrt(
        blocks(variance.reshape(HEIGHT, WIDTH, 3)[::-1])
    ) / BLOCK


def blocks(image):
    """The mean of each block."""
    return image.reshape(HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK, 3).mean(axis=(1, 3))


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["uniform", "brdf", "microfacet"])
def test_three_spheres_are_those_of_float64(scene, estimator):
    """A t of 6.5 with 15 degrees of freedom has a probability of 1e-5; there are 36 numbers in each of three cases."""
    right, error = expected(np.asarray(scene.environment.pixels, float), estimator == "microfacet")
    renderer, found = tt.A2Renderer(scene, WIDTH, HEIGHT, jitter=False).use(estimator), []
    for seed in range(SEEDS):
        renderer.seed = seed
        renderer.reset()
        found.append(blocks(np.asarray(renderer.render(SPP).image(), float)))
    own = np.std(found, axis=0, ddof=1) / np.sqrt(SEEDS)
    z = (np.mean(found, axis=0) - right) / np.sqrt(error**2 + own**2 + (1e-4 * right) ** 2)
    assert np.abs(z).max() < 6.5, z.round(1)
