"""Random numbers: their bits, their evenness, their independence; directions against their densities."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import numbers
from scipy import stats
from support import start

from taichi_tracer import sampler
from taichi_tracer.system import runtime


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@ti.kernel
def _points(samples: ti.template(), seed: ti.u32, pixel: ti.u32, dimension: ti.u32, out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        x, y = samples.get_2d(seed, pixel, ti.cast(i, ti.u32), dimension)
        out[i, 0], out[i, 1] = x, y


def points(samples, count, seed=1, pixel=2, dimension=0):
    out = np.zeros((count, 2), runtime.dtype())
    _points(samples, seed, pixel, dimension, out)
    return out


@ti.kernel
def _words(function: ti.template(), out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        word = ti.cast(out[i, 0], ti.u32)
        out[i, 1] = ti.cast(function(word), ti.i64)


def apply(function, words):
    out = np.stack([words, words], axis=1).astype(np.int64)
    _words(function, out)
    return out[:, 1]


def test_hash_is_that_of_the_paper():
    keys = [(0, 0, 0, 0), (1, 2, 3, 4), (2**32 - 1, 77, 2**31, 5)]

    for key in keys:
        x, y = points_of_independent(*key)
        a, b, _, _ = numbers.pcg4d(*key)
        assert x == np.float32((a >> 8) / 2**24)
        assert y == np.float32((b >> 8) / 2**24)


def points_of_independent(pixel, index, dimension, seed):
    @ti.kernel
    def one(s: ti.u32, p: ti.u32, i: ti.u32, d: ti.u32, out: ti.types.ndarray(ndim=1)):
        for _ in range(1):
            x, y = sampler.IndependentSampler.get_2d(s, p, i, d)
            out[0], out[1] = x, y

    out = np.zeros(2, np.float32)
    one(seed, pixel, index, dimension, out)
    return out


def test_second_dimension_is_that_of_sobol(rng):
    words = np.concatenate([np.arange(64), rng.integers(0, 2**32, 500)])
    reversed_ = [int(f"{word:032b}"[::-1], 2) for word in apply(sampler.pascal_matrix, words).tolist()]
    assert reversed_ == [numbers.sobol(int(word))[1] for word in words]
    assert apply(sampler.reverse_bits, words).tolist() == [numbers.sobol(int(word))[0] for word in words]


@pytest.mark.parametrize("bits", [4, 6, 8])
def test_sobol_points_are_nets(bits):
    """Every box of volume 2^−m holds one of each 2^m consecutive samples of a replica, whatever its shape."""
    count = 1 << bits
    for pixel in range(5):
        all_points = points(sampler.SobolSampler, 4 * count, pixel=pixel, dimension=pixel % 3).astype(np.float64)
        even, odd = all_points[::2], all_points[1::2]
        for block in (even[:count], even[count:], odd[:count], odd[count:]):
            for k in range(bits + 1):
                cells = np.floor(block * [1 << k, count >> k])
                assert len({tuple(cell) for cell in cells}) == count


@pytest.mark.parametrize("samples", sampler.ALL, ids=lambda s: s.name)
def test_numbers_are_uniform_below_one_and_their_own(samples):
    p = points(samples, 1 << 16).astype(np.float64)
    assert p.min() >= 0
    assert p.max() < 1
    for k in range(2):
        assert stats.kstest(p[:, k], "uniform").pvalue > 1e-4
    assert abs(np.corrcoef(p.T)[0, 1]) < 4 / 256
    for other in ({"seed": 2}, {"pixel": 3}, {"dimension": 1}):
        q = points(samples, 1 << 12, **other).astype(np.float64)
        assert abs(np.corrcoef(p[: 1 << 12, 0], q[:, 0])[0, 1]) < 4 / 64, other
    np.testing.assert_array_equal(points(samples, 1 << 12), p[: 1 << 12])


def test_the_largest_word_is_not_one():
    @ti.kernel
    def run(out: ti.types.ndarray(ndim=1)):
        for i in range(1):
            out[i] = sampler.as_fraction(ti.u32(0xFFFFFFFF))

    out = np.zeros(1, np.float32)
    run(out)
    assert out[0] == np.float32(1 - 2.0**-24)


@ti.kernel
def _directions(kind: ti.template(), axis: tm.vec3, exponent: float, xi: ti.types.ndarray(), out: ti.types.ndarray()):
    for i in range(out.shape[0]):
        point = tm.vec2(xi[i, 0], xi[i, 1])
        w = tm.vec3(0)
        if ti.static(kind == "sphere"):
            w = sampler.uniform_sphere(point)
        elif ti.static(kind == "hemisphere"):
            w = sampler.uniform_hemisphere(axis, point)
        elif ti.static(kind == "cosine"):
            w = sampler.cosine_hemisphere(axis, point)
        else:
            w = sampler.power_cosine(axis, exponent, point)
        for k in ti.static(range(3)):
            out[i, k] = w[k]


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
    """χ² of 1e6 samples over 16 × 32 cells of equal probability, by the distribution of the cosine; p > 1e-4."""
    exponent, distribution = KINDS[kind]
    rng = np.random.default_rng(1)
    xi = rng.random((1_000_000, 2)).astype(np.float32)
    out = np.zeros((len(xi), 3), np.float32)
    _directions(kind, ti.Vector(axis), exponent, xi, out)
    w, n = out.astype(np.float64), np.array(axis, float)
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
    counts, _, _ = np.histogram2d(distribution(cosine), phi, bins=(16, 32), range=((0, 1), (0, 1)))
    assert counts.sum() == len(xi)
    assert stats.chisquare(counts.ravel()).pvalue > 1e-4


@pytest.mark.parametrize("xi", [(0.0, 0.0), (0.0, 0.5), (1 - 2.0**-24, 1 - 2.0**-24)])
@pytest.mark.parametrize("kind", KINDS)
def test_the_ends_of_the_unit_interval_give_unit_vectors(kind, xi):
    out = np.zeros((1, 3), np.float32)
    _directions(kind, ti.Vector([0.0, 1.0, 0.0]), KINDS[kind][0], np.array([xi], np.float32), out)
    assert np.isfinite(out).all()
    np.testing.assert_allclose(np.linalg.norm(out), 1, atol=1e-6)


def test_frames_are_right_handed_and_orthonormal(precision, rng):
    n = rng.normal(size=(20_000, 3))
    n[:6] = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [1e-8, 0, -1], [0, 1e-4, -1]]
    n = (n / np.linalg.norm(n, axis=1, keepdims=True)).astype(runtime.dtype())

    @ti.kernel
    def run(axes: ti.types.ndarray(), out: ti.types.ndarray()):
        for i in range(axes.shape[0]):
            x, y = sampler.frame_about(tm.vec3(axes[i, 0], axes[i, 1], axes[i, 2]))
            for k in ti.static(range(3)):
                out[i, k], out[i, 3 + k] = x[k], y[k]

    out = np.zeros((len(n), 6), runtime.dtype())
    run(n, out)
    x, y = out[:, :3].astype(np.float64), out[:, 3:].astype(np.float64)
    tolerance = 4e-7 if precision == "f32" else 1e-15
    np.testing.assert_allclose(np.cross(x, y), n, atol=tolerance)
    np.testing.assert_allclose((x * y).sum(1), 0, atol=tolerance)
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1, atol=tolerance)
