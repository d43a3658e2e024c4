"""Directions made of two uniform numbers against their densities: χ² over cells of equal probability."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from scipy import stats

from taichi_tracer.formulas import warps
from taichi_tracer.system import runtime

pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def _directions(kind: ti.template(), axis: tm.vec3, exponent: float, xi: ti.types.ndarray(), out: ti.types.ndarray()):
    for i in range(out.shape[0]):
        point = tm.vec2(xi[i, 0], xi[i, 1])
        w = tm.vec3(0)
        if ti.static(kind == "sphere"):
            w = warps.uniform_sphere(point)
        elif ti.static(kind == "hemisphere"):
            w = warps.uniform_hemisphere(axis, point)
        elif ti.static(kind == "cosine"):
            w = warps.cosine_hemisphere(axis, point)
        else:
            w = warps.power_cosine(axis, exponent, point)
        for k in ti.static(range(3)):
            out[i, k] = w[k]


def directions(kind, axis, xi):
    """(N, 3) in the running precision."""
    out = np.zeros((len(xi), 3), runtime.dtype())
    _directions(kind, ti.Vector(axis), KINDS[kind][0], np.ascontiguousarray(xi, runtime.dtype()), out)
    return out


# Name → exponent of the cosine, and the distribution function of the cosine.
KINDS = {
    "sphere": (0.0, lambda c: (c + 1) / 2),
    "hemisphere": (0.0, lambda c: np.maximum(c, 0)),
    "cosine": (1.0, lambda c: np.maximum(c, 0) ** 2),
    "power": (7.0, lambda c: np.maximum(c, 0) ** 8),
    "sharp": (1e4, lambda c: np.maximum(c, 0) ** (1e4 + 1)),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (0.6, -0.48, 0.64)])
def test_directions_follow_their_density(kind, axis):
    """χ² of 250,000 samples over 16 × 32 cells of equal probability, by the distribution of the cosine; p > 1e-4."""
    xi = np.random.default_rng(1).random((250_000, 2)).astype(np.float32)
    w, n = directions(kind, axis, xi).astype(np.float64), np.array(axis, float)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=1e-6)
    side = np.cross(n, [1, 0, 0] if abs(n[0]) < 0.5 else [0, 1, 0])
    side /= np.linalg.norm(side)
    cosine = w @ (np.array([0, 0, 1.0]) if kind == "sphere" else n)
    if kind == "sphere":
        n, side = np.array([0, 0, 1.0]), np.array([1.0, 0, 0])
    if kind == "sharp":  # near 1 the cosine itself has too few digits: from the sine
        sine = np.linalg.norm(np.cross(w, n), axis=1)
        cosine = np.sqrt(1 - sine**2)
    phi = np.arctan2(w @ np.cross(n, side), w @ side) / (2 * np.pi) + 0.5
    counts, _, _ = np.histogram2d(KINDS[kind][1](cosine), phi, bins=(16, 32), range=((0, 1), (0, 1)))
    assert counts.sum() == len(xi)
    assert stats.chisquare(counts.ravel()).pvalue > 1e-4


@pytest.mark.parametrize("xi", [(0.0, 0.0), (0.0, 0.5), (1 - 2.0**-24, 1 - 2.0**-24)])
@pytest.mark.parametrize("kind", KINDS)
def test_the_ends_of_the_unit_interval_give_unit_vectors(kind, xi):
    out = directions(kind, (0.0, 1.0, 0.0), [xi])
    assert np.isfinite(out).all()
    np.testing.assert_allclose(np.linalg.norm(out), 1, atol=1e-6)


@pytest.mark.parametrize("kind", ["power", "sharp"])
def test_the_cosine_is_a_power_of_xi(kind):
    """A2-7: ω_z = ξ^(1/(α+1)), through the whole interval; from the sine, which keeps its digits."""
    xi = np.stack([np.linspace(1e-6, 1 - 1e-6, 999), np.full(999, 0.25)], axis=1).astype(np.float32)
    found = directions(kind, (0.0, 0.0, 1.0), xi).astype(np.float64)
    exponent = KINDS[kind][0]
    exact = np.sqrt(-np.expm1(2 * np.log(xi[:, 0].astype(np.float64)) / (exponent + 1)))
    np.testing.assert_allclose(np.hypot(found[:, 0], found[:, 1]), exact, rtol=3e-4)
