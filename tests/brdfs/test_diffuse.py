"""The diffuse BRDF: f_r = Kd/π, sampled by the cosine."""

import numpy as np
import pytest
from oracles import light
from probe import brdf_samples, brdf_values
from scipy import stats

from taichi_tracer.brdfs.diffuse import Diffuse
from taichi_tracer.materials import Material


def test_values_are_those_of_the_formula(precision, rng):
    w_o, w_i = light.hemisphere(rng, 20_000), light.sphere(rng, 20_000)
    f, pdf, weight = brdf_values(Diffuse(), 1.0, w_o, w_i).T
    np.testing.assert_allclose(f, 0.75 / np.pi, rtol=1e-6)
    np.testing.assert_allclose(pdf, np.maximum(w_i[:, 2], 0) / np.pi, atol=1e-7)
    np.testing.assert_allclose(weight, 0.75)


def test_samples_have_a_uniform_squared_cosine(f32, rng):
    """cos² θ and φ are uniform, whatever the viewer (Kolmogorov and Smirnov; p > 1e-3 each)."""
    w_i = brdf_samples(Diffuse(), 1.0, (0.6, 0.0, 0.8), (0, 0, 1), rng.random((20_000, 2)))
    assert stats.kstest(w_i[:, 2] ** 2, "uniform").pvalue > 1e-3
    assert stats.kstest(np.arctan2(w_i[:, 1], w_i[:, 0]) / (2 * np.pi) + 0.5, "uniform").pvalue > 1e-3


@pytest.mark.parametrize(("ns", "is_diffuse"), [(0, True), (0.5, True), (1, True), (1.0001, False), (1e12, False)])
def test_an_exponent_of_1_or_less_is_diffuse(ns, is_diffuse):
    """C-4."""
    for dtype in (np.float32, np.float64):
        assert Diffuse().describes(Material(Ns=ns), dtype) is is_diffuse
