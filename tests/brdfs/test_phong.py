"""Phong's lobe against its formula in float64, also where the lobe is narrower than a cosine can tell."""

import numpy as np
import pytest
from oracles import light
from probe import brdf_samples, brdf_values
from scipy import stats

from taichi_tracer.brdfs.phong import MIRROR_FROM, Phong
from taichi_tracer.materials import Material
from taichi_tracer.system import runtime


@pytest.mark.parametrize("ns", [1.5, 2, 50, 1e3])
def test_values_are_those_of_the_formula(precision, rng, ns):
    """C-2: the cosine is clamped before the power, so that an even α does not light the back."""
    w_o, w_i = light.hemisphere(rng, 20_000), light.sphere(rng, 20_000)
    near = light.to_unit(w_o * [-1, -1, 1] + np.random.default_rng(1).normal(size=w_o.shape) * 3 / np.sqrt(ns))
    w_i = np.where(np.arange(len(w_i))[:, None] % 2 == 0, near, w_i)
    f, pdf, weight = brdf_values(Phong(), ns, w_o, w_i).T
    dtype = runtime.dtype()
    o, i = w_o.astype(dtype).astype(float), w_i.astype(dtype).astype(float)
    reflected = o * [-1, -1, 1]
    cosine = np.maximum((reflected * i).sum(1), 0)
    expected = (ns + 1) / (2 * np.pi) * cosine**ns
    tolerance = (3e-4 if ns > 100 else 2e-5) if precision == "f32" else 1e-9
    np.testing.assert_allclose(pdf, expected, rtol=tolerance, atol=1e-5)
    np.testing.assert_allclose(f, 0.75 * pdf, rtol=1e-6)
    np.testing.assert_allclose(weight, 0.75 * np.maximum(i[:, 2], 0), atol=1e-6)
    assert (f[(reflected * i).sum(1) < 0] == 0).all()


@pytest.mark.parametrize("ns", [1e6, 1e9, 1e12])
def test_narrow_lobes_keep_their_shape(f32, ns):
    """Where cos has rounded to 1, the pdf still falls as exp(−α θ²/2)."""
    angle = np.linspace(0, 3, 50) / np.sqrt(ns)
    w_i = np.stack([np.sin(angle), np.zeros(50), np.cos(angle)], axis=1).astype(np.float32)
    pdf = brdf_values(Phong(), ns, np.tile([0.0, 0.0, 1.0], (50, 1)), w_i)[:, 1]
    exact = (ns + 1) / (2 * np.pi) * np.exp(-ns * w_i[:, 0].astype(float) ** 2 / 2)
    np.testing.assert_allclose(pdf, exact, rtol=1e-3)


def test_samples_lie_about_the_mirrored_direction(f32, rng):
    """(ω_r·ω_i)^(α+1) is uniform (Kolmogorov and Smirnov; p > 1e-3)."""
    w_i = brdf_samples(Phong(), 30.0, (0.6, 0.0, 0.8), (0, 0, 1), rng.random((20_000, 2)))
    cosine = w_i @ [-0.6, 0.0, 0.8]
    assert stats.kstest(cosine**31, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("ns", [2.0, 20.0, 1e3])
def test_the_weight_of_a_sample_adds_up_to_the_albedo(f32, rng, ns):
    """C-19: Kd (Ns+1)/(Ns+2) at normal incidence; z < 4.5 (p = 7e-6)."""
    n = np.array([[0.0, 0.0, 1.0]])
    w_i = brdf_samples(Phong(), ns, (0, 0, 1), (0, 0, 1), rng.random((20_000, 2)))
    weight = brdf_values(Phong(), ns, np.repeat(n, len(w_i), axis=0), w_i)[:, 2]
    assert abs(weight.mean() - 0.75 * (ns + 1) / (ns + 2)) < 4.5 * weight.std() / np.sqrt(len(weight))


@pytest.mark.parametrize(
    ("ns", "is_phong"), [(1, False), (1.0001, True), (1e12, True), (7e13, True), (7.1e13, False), (1e21, False)]
)
def test_exponents_above_1_are_phong_as_long_as_the_lobe_is_wider_than_rounding(ns, is_phong):
    """C-4, C-3. Both precisions mean the same scene."""
    assert Phong().describes(Material(Ns=ns), np.float32) is is_phong
    assert Phong().describes(Material(Ns=ns), np.float64) is is_phong


def test_a_lobe_of_the_largest_exponent_is_as_wide_as_the_epsilon_of_f32():
    assert 1 / np.sqrt(MIRROR_FROM) == np.finfo(np.float32).eps
