"""The interface of samplers, and the handouts' samplers of directions."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from oracles import light
from probe import Numbers, brdf_values, put
from scipy import stats
from sequences import SOBOL, points
from support import needs_patches, start

import taichi_tracer as tt
from taichi_tracer import sampler
from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.brdfs.phong import Phong
from taichi_tracer.samplers.sobol import SobolSampler

pytestmark = pytest.mark.usefixtures("f32")


# ── the handouts' functions, which draw their own numbers ──


@ti.kernel
def _sphere_directions(begins: ti.template(), gives: ti.template(), out: ti.types.ndarray(ndim=2)):
    for i in range(out.shape[0]):
        if ti.static(begins):
            rng = SOBOL.start(ti.u32(9), i, 0, ti.u32(0))
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
    with pytest.raises((ti.TaichiCompilationError, tt.InputError)):
        tt.A2Renderer(scene, 8, 8, sampler=wrong()).use("brdf").render(1)


def test_a_sampler_that_returns_three_numbers_is_told():
    needs_patches()
    scene = tt.load_scene_data("cube", environment="studio")
    with pytest.raises(tt.InputError, match="ThreeNumbers.get_2d returns a vec3, but a vec2 is needed"):
        tt.A2Renderer(scene, 8, 8, sampler=ThreeNumbers()).use("brdf").render(1)


def test_in_a_sample_directions_come_from_its_next_numbers():
    """The same on every run, and each call takes the next dimension."""
    found = sphere_directions(True)
    np.testing.assert_array_equal(found, sphere_directions(True))
    assert (found[:, 6] == 2).all()
    first, second = (points(SOBOL, 1, seed=9, pixel=17, dimension=d)[0] for d in range(2))
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
