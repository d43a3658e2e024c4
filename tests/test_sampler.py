"""Random numbers: their nets, their evenness, whose they are; and the handouts' two samplers of directions."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light, numbers
from probe import Numbers, brdf_values, put
from scipy import stats
from support import start

import taichi_tracer as tt
from taichi_tracer import sampler
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.phong import Phong
from taichi_tracer.random_numbers import TERM_BIT
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.samplers.niederreiter import NiederreiterSampler
from taichi_tracer.samplers.sobol import SobolSampler
from taichi_tracer.system import runtime
from taichi_tracer.system.registry import PARTS

SAMPLERS = [SobolSampler(), IndependentSampler(), NiederreiterSampler()]
TERM = 1 << TERM_BIT  # the first pair of ``next_2d_of_term``, as a part of the dimension


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


# ── points ──


@ti.kernel
def _points(samples: ti.template(), seed: ti.u32, pixel: ti.u32, dimension: ti.u32, out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        x, y = samples.get_2d(seed, pixel, ti.cast(i, ti.u32), dimension)
        out[i, 0], out[i, 1] = x, y


def points(samples, count, seed=1, pixel=2, dimension=0):
    out = np.zeros((count, 2), runtime.dtype())
    _points(samples, seed, pixel, dimension, out)
    return out


@pytest.mark.parametrize("key", [(0, 0, 0, 0), (1, 2, 3, 4), (2**32 - 1, 77, 2**31, 5)])
def test_independent_numbers_are_the_hash_of_their_key(key):
    pixel, index, dimension, seed = key

    @ti.kernel
    def one(samples: ti.template(), s: ti.u32, p: ti.u32, i: ti.u32, d: ti.u32, out: ti.types.ndarray(ndim=1)):
        for _ in range(1):
            x, y = samples.get_2d(s, p, i, d)
            out[0], out[1] = x, y

    out = np.zeros(2, np.float32)
    one(IndependentSampler(), seed, pixel, index, dimension, out)
    a, b, _, _ = numbers.pcg4d(*key)
    assert out.tolist() == [np.float32((word >> 8) / 2**24) for word in (a, b)]


@pytest.mark.parametrize("bits", [4, 6, 8])
def test_sobol_points_are_nets(bits):
    """Every box of volume 2^−m holds one of each 2^m consecutive samples of a replica, whatever its shape."""
    count = 1 << bits
    for pixel in range(5):
        all_points = points(SAMPLERS[0], 4 * count, pixel=pixel, dimension=pixel % 3).astype(np.float64)
        even, odd = all_points[::2], all_points[1::2]
        for block in (even[:count], even[count:], odd[:count], odd[count:]):
            for k in range(bits + 1):
                cells = np.floor(block * [1 << k, count >> k])
                assert len({tuple(cell) for cell in cells}) == count


@pytest.mark.parametrize("other", [1, 1 | TERM, 1 | 7 * TERM])
def test_the_pixel_and_each_direction_of_the_first_surface_are_nets_together(other):
    """Every box of volume 4^−m whose sides are powers of 1/4 holds one of each 4^m consecutive samples of a replica."""
    samples, m = SAMPLERS[2], 4
    for pixel in range(3):
        dimensions = (points(samples, 4 << (2 * m), pixel=pixel, dimension=d) for d in (0, other))
        both = np.concatenate(list(dimensions), axis=1).astype(np.float64)
        for block in (both[0::2][: 4**m], both[1::2][: 4**m], both[1::2][4**m :]):
            for depths in itertools.product(range(m + 1), repeat=4):
                if sum(depths) == m:
                    cells = np.floor(block * 4.0 ** np.array(depths))
                    assert len(np.unique(cells, axis=0)) == 4**m, depths


def test_any_two_dimensions_take_all_combinations():
    """The mean of a product of two dimensions becomes right; numbers of one order would stay wrong for ever.

    f = (x − 1/2)(x' − 1/2) has the variance 1/144. For 4096 samples of 64 pixels, the root mean square of the means is
    at most 1.3 times that of independent numbers. Pairs that share a dimension miss this by far; see the last line.
    """

    def deviation(first, second):
        means = []
        for pixel in range(64):
            a, b = (points(SAMPLERS[2], 4096, pixel=pixel, dimension=d)[:, 0].astype(float) for d in (first, second))
            means.append(((a - 0.5) * (b - 0.5)).mean())
        return np.sqrt(np.mean(np.square(means))) * 12 * np.sqrt(4096)

    for first, second in ((0, 1), (1, 2), (2, 3), (0, 2), (1, 4), (1 | TERM, 2 | 2 * TERM)):
        assert deviation(first, second) < 1.5, (first, second)
    assert deviation(1, 1 | TERM) > 10


def test_light_that_changes_across_a_pixel_has_a_smaller_error_than_with_separate_pairs():
    """The mean of a step that crosses pixel and direction: 512 samples of 64 pixels, f = 1 where x + x' > 1."""

    def deviation(samples):
        means = []
        for pixel in range(64):
            a, b = (points(samples, 512, pixel=pixel, dimension=d).astype(float) for d in (0, 1))
            means.append(((a[:, 0] + b[:, 0] > 1) * (a[:, 1] + b[:, 1] > 1)).mean())
        return np.sqrt(np.mean(np.square(np.array(means) - 0.25)))

    assert deviation(SAMPLERS[2]) < deviation(SAMPLERS[0]) / 1.25


@ti.kernel
def _terms_of_a_sample(samples: ti.template(), out: ti.types.ndarray(ndim=1)):
    for _ in range(1):
        rng = samples.start(ti.u32(1), 0, 0, ti.u32(5))
        out[0] = rng.next_2d().x
        out[1] = rng.next_2d_of_term().x
        out[2] = rng.next_2d_of_term().x
        out[3] = rng.next_2d().x
        rng.skip_2d_of_term()
        out[4] = rng.next_2d_of_term().x
        out[5] = rng.next_1d()


@pytest.mark.parametrize(
    ("samples", "dimensions"),
    [
        *((one, (0, 1, 2, 3, 5, 6)) for one in SAMPLERS[:2]),
        (SAMPLERS[2], (0, 1 | TERM, 1 | 2 * TERM, 1, 2 | 3 * TERM, 2)),
    ],
    ids=lambda s: getattr(s, "name", ""),
)
def test_terms_share_a_dimension_where_the_sampler_says_so(samples, dimensions):
    out = np.zeros(6, np.float32)
    _terms_of_a_sample(samples, out)
    np.testing.assert_array_equal(out, [points(samples, 6, pixel=0, dimension=d)[5, 0] for d in dimensions])


@pytest.mark.parametrize("samples", SAMPLERS, ids=lambda s: s.name)
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


@pytest.mark.parametrize("samples", SAMPLERS, ids=lambda s: s.name)
def test_vectors_of_keys_give_the_numbers_of_single_keys(samples):
    """What the fast forms take: the numbers of several pixels at once."""

    @ti.kernel
    def four(out: ti.types.ndarray(ndim=2)):
        for i in range(out.shape[0]):
            zero = ti.Vector([ti.u32(0)] * 4)
            pixels = ti.Vector([ti.cast(k, ti.u32) for k in range(4)])
            x, y = samples.point(ti.u32(1) + zero, pixels, ti.cast(i, ti.u32) + zero, ti.u32(3) + zero)
            for k in ti.static(range(4)):
                out[i, 2 * k], out[i, 2 * k + 1] = x[k], y[k]

    out = np.zeros((64, 8), np.float32)
    four(out)
    expected = [points(samples, 64, pixel=pixel, dimension=3) for pixel in range(4)]
    np.testing.assert_array_equal(out, np.concatenate(expected, axis=1))


# ── the numbers of one sample ──


@ti.kernel
def _numbers_of_a_sample(samples: ti.template(), x: int, y: int, out: ti.types.ndarray(ndim=1)):
    for _ in range(1):
        rng = samples.start(ti.u32(1), x, y, ti.u32(5))
        first = rng.next_2d()
        out[0], out[1], out[2] = first.x, first.y, rng.next_1d()
        rng.skip_2d()
        for k in range(3, 6):  # a loop of the kernel, which takes one dimension in each turn
            out[k] = rng.next_1d()
        out[6] = ti.cast(rng.dimension, float)


@pytest.mark.parametrize("samples", SAMPLERS, ids=lambda s: s.name)
def test_each_call_takes_the_numbers_of_the_next_dimension(samples):
    own = sampler.sampler_of(samples, SimpleNamespace(width=10, height=8))
    out = np.zeros(7, np.float32)
    _numbers_of_a_sample(own, 3, 7, out)
    at = [points(samples, 6, pixel=73, dimension=d)[5] for d in range(6)]
    np.testing.assert_array_equal(out[:3], [at[0][0], at[0][1], at[1][0]])
    np.testing.assert_array_equal(out[3:6], [at[3][0], at[4][0], at[5][0]])
    assert out[6] == 6


def test_a_sampler_of_a_camera_is_a_copy_with_its_size():
    own = sampler.sampler_of(PARTS.find("sampler", "sobol"), tt.Camera(10, 8))
    assert (own.width, own.height) == (10, 8)
    assert PARTS.find("sampler", "sobol").width == 1


def test_a_sampler_without_numbers_is_asked_for_them_by_name():
    @ti.data_oriented
    class Unfinished(sampler.Sampler):
        pass

    with pytest.raises(ti.TaichiCompilationError, match=r"a sampler must say what get_2d\(self"):
        points(Unfinished(), 1)


# ── the handouts' functions, which draw their own numbers ──


@ti.kernel
def _sphere_directions(begins: ti.template(), gives: ti.template(), out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        if ti.static(begins):
            rng = SAMPLERS[0].start(ti.u32(9), i, 0, ti.u32(0))
            put(out, i, 0, sampler.UniformSampler.sample_direction())
            put(out, i, 3, sampler.UniformSampler.sample_direction())
            out[i, 6] = ti.cast(rng.dimension, float)
        elif ti.static(gives):
            put(out, i, 0, sampler.UniformSampler.sample_direction(tm.vec2(0.25, 0.75)))
        else:
            put(out, i, 0, sampler.UniformSampler.sample_direction())
            put(out, i, 3, sampler.UniformSampler.sample_direction())
        out[i, 7] = sampler.UniformSampler.evaluate_probability()


def sphere_directions(begins, gives=False, count=4_000):
    out = np.zeros((count, 8), np.float32)
    _sphere_directions(begins, gives, out)
    return out


class NoReturn(sampler.Sampler):
    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        pass


class OneNumber(sampler.Sampler):
    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        return ti.random(float)


class OneNumberPerPoint(SobolSampler):
    @ti.func
    def point(self, seed, pixel, index, dimension):
        return ti.random(float)


class ThreeNumbers(sampler.Sampler):
    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        return tm.vec3(0.25, 0.5, 0.75)


@pytest.mark.parametrize("wrong", [NoReturn, OneNumber, OneNumberPerPoint])
def test_a_sampler_that_returns_no_pair_is_an_error_that_python_can_catch(wrong):
    scene = tt.load_scene_data("cube", environment="studio")
    with pytest.raises(ti.TaichiCompilationError):
        tt.A2Renderer(scene, 8, 8, sampler=wrong()).use("brdf").render(1)


def test_what_a_samplers_own_method_returns_is_passed_on_as_it_is():
    scene = tt.load_scene_data("cube", environment="studio")
    picture = tt.A2Renderer(scene, 8, 8, sampler=ThreeNumbers()).use("brdf").render(1).image()
    assert np.isfinite(picture).all()
    assert picture.max() > 0


def test_directions_come_from_the_numbers_that_were_given():
    found = sphere_directions(False, gives=True, count=3)
    np.testing.assert_allclose(found[:, :3], np.tile([0, -np.sqrt(0.75), -0.5], (3, 1)), atol=1e-6)
    np.testing.assert_allclose(found[:, 7], 1 / (4 * np.pi))


def test_in_a_sample_directions_come_from_its_next_numbers():
    """The same on every run, and each call takes the next dimension."""
    found = sphere_directions(True)
    np.testing.assert_array_equal(found, sphere_directions(True))
    assert (found[:, 6] == 2).all()
    first, second = (points(SAMPLERS[0], 1, seed=9, pixel=17, dimension=d)[0] for d in range(2))
    for (x, y), w in ((first, found[17, :3]), (second, found[17, 3:6])):
        r, phi = np.sqrt(1 - (2 * x - 1) ** 2), 2 * np.pi * y
        np.testing.assert_allclose(w, [r * np.cos(phi), r * np.sin(phi), 2 * x - 1], atol=1e-6)


def test_without_a_sample_directions_come_from_taichi():
    """A kernel of a student's own gets uniform directions as well (Kolmogorov and Smirnov; p > 1e-4 each)."""
    found = sphere_directions(False)
    for w in (found[:, :3], found[:, 3:6]):
        np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=1e-6)
        assert stats.kstest((w[:, 2] + 1) / 2, "uniform").pvalue > 1e-4
        assert stats.kstest(np.arctan2(w[:, 1], w[:, 0]) / (2 * np.pi) + 0.5, "uniform").pvalue > 1e-4
    assert abs(np.corrcoef(found[:, 2], found[:, 5])[0, 1]) < 4 / np.sqrt(len(found))
    # A kernel that begins numbers leaves none behind for the next one.
    sphere_directions(True)
    assert not np.array_equal(sphere_directions(False)[:, :3], sphere_directions(True)[:, :3])


# ── the handout's BRDF ──


@pytest.mark.parametrize(("ns", "own"), [(1.0, Diffuse()), (0.0, Diffuse()), (1.5, Phong()), (40.0, Phong())])
def test_the_handouts_brdf_computes_what_the_scenes_own_do(precision, rng, ns, own):
    w_o, w_i = light.hemisphere(rng, 5_000), light.sphere(rng, 5_000)
    np.testing.assert_array_equal(brdf_values(sampler.BRDF(), ns, w_o, w_i), brdf_values(own, ns, w_o, w_i))


@ti.kernel
def _handout_samples(ns: float, given: ti.template(), out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        m = Numbers(Kd=tm.vec3(1), Ns=ns)
        w_o, n = tm.vec3(0.6, 0, 0.8), tm.vec3(0, 0, 1)
        if ti.static(given):
            put(out, i, 0, sampler.BRDF.sample_direction(m, w_o, n, tm.vec2(0.2, 0.4)))
        else:
            put(out, i, 0, sampler.BRDF.sample_direction(m, w_o, n))


@pytest.mark.parametrize("ns", [1.0, 9.0])
def test_the_handouts_brdf_draws_its_own_numbers_where_none_are_given(ns):
    """(ω·axis)^(α+1) is uniform, with α = 1 about n and α = Ns about ω_r (Kolmogorov and Smirnov; p > 1e-4)."""
    start("f32")
    out = np.zeros((4_000, 3), np.float32)
    _handout_samples(ns, False, out)
    cosine = out @ ([0, 0, 1] if ns == 1 else [-0.6, 0, 0.8])
    assert stats.kstest(cosine ** (ns + 1), "uniform").pvalue > 1e-4
    _handout_samples(ns, True, out)
    assert (out == out[0]).all()


def test_a_replaced_part_of_the_handouts_brdf_decides_its_weight(rng):
    """Without a factor of its own, the weight is f_r cos θ_i / pdf of what was replaced."""

    @ti.data_oriented
    class Half(sampler.BRDF):
        @ti.func
        def evaluate_brdf(self, material, w_o, w_i, normal):
            return material.Kd / (2 * tm.pi)

    @ti.data_oriented
    class WithFactor(Half):
        @ti.func
        def evaluate_brdf_factor(self, material, w_o, w_i, normal):
            return tm.vec3(3)

    start("f32")
    w = light.hemisphere(rng, 1_000)
    np.testing.assert_allclose(brdf_values(Half(), 1.0, w, w)[:, 2], 0.75 / 2, rtol=1e-5)
    np.testing.assert_array_equal(brdf_values(WithFactor(), 1.0, w, w)[:, 2], 3)
    assert not Half().has_own_factor()
    assert WithFactor().has_own_factor()
    assert sampler.BRDF().has_own_factor()


def test_a_method_that_the_handout_wrote_without_self_is_called(monkeypatch, rng):
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        return material.Kd * 2

    start("f32")
    monkeypatch.setattr(sampler.BRDF, "evaluate_brdf", evaluate_brdf)
    w = light.hemisphere(rng, 100)
    np.testing.assert_array_equal(brdf_values(sampler.BRDF(), 1.0, w, w)[:, 0], 1.5)
