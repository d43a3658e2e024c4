"""The layered surface of glTF files: what its limits are."""

import numpy as np
import pytest
from brdfs.test_microfacet import above, bench
from oracles import microfacets as oracle

from taichi_tracer.brdfs.microfacet import LAYERED, MicrofacetBRDF
from taichi_tracer.brdfs.rough_layer import RoughLayer
from taichi_tracer.contracts.brdfs import Bench
from taichi_tracer.materials import Material

N = np.array([0.0, 0.0, 1.0])


def layered(kd, f0, alpha):
    material = Material(Kd=(kd,) * 3, F0=(f0,) * 3, alpha_x=alpha, alpha_y=alpha, extra={LAYERED: (1.0,)})
    return Bench(RoughLayer(), [material])


@pytest.mark.parametrize(("kd", "f0", "alpha"), [(0.5, 0.04, 0.3), (0.4, 0.5, 0.1), (0.9, 0.04, 1.0)])
def test_it_is_what_the_base_and_the_layer_reflect(kd, f0, alpha, f32, rng):
    w_o, w_i = above(rng, 2000), above(rng, 2000)
    found, pdf, weight = layered(kd, f0, alpha).values(0, w_o, N, w_i)
    passes = [0.96 * (1 - (1 - w[:, 2:]) ** 5) for w in (w_o, w_i)]
    layer, pdf_of_layer, _ = oracle.parts((alpha, alpha), (f0,) * 3, w_o, w_i)
    expected = passes[0] * passes[1] * kd / np.pi + layer
    np.testing.assert_allclose(found, expected, rtol=3e-3, atol=1e-6)
    of_base = w_i[:, 2] / np.pi
    assert (pdf > 0.99 * np.minimum(of_base, pdf_of_layer)).all()
    assert (pdf < 1.01 * np.maximum(of_base, pdf_of_layer)).all()
    np.testing.assert_allclose(weight, found * w_i[:, 2:] / pdf[:, None], rtol=1e-4)


@pytest.mark.parametrize(("kd", "f0", "alpha"), [(0.5, 0.04, 0.3), (0.4, 0.5, 0.4)])
def test_samples_have_the_density_that_it_says(kd, f0, alpha, f32, rng):
    """The mean of h/pdf over samples is ∫ h dω, for h = z and h = x² (4 σ, fixed numbers)."""
    made, w_o = layered(kd, f0, alpha), np.array([0.6, 0, 0.8])
    w_i = made.sample(0, w_o, N, rng.random((200_000, 2)))
    _, pdf, _ = made.values(0, w_o, N, w_i)
    is_above = w_i[:, 2] > 0
    for h, integral in ((w_i[:, 2], np.pi), (w_i[:, 0] ** 2, 2 * np.pi / 3)):
        quotient = np.where(is_above, h / np.where(is_above, pdf, 1), 0)
        assert abs(quotient.mean() - integral) < 4 * quotient.std() / np.sqrt(len(quotient))


def test_without_a_base_it_has_the_layers_value(f32, rng):
    w_o, w_i = above(rng, 100), above(rng, 100)
    plain = bench((0.3, 0.3), (0.9, 0.9, 0.9)).values(0, w_o, N, w_i)[0]
    found = layered(0.0, 0.9, 0.3).values(0, w_o, N, w_i)[0]
    np.testing.assert_allclose(found, plain, rtol=1e-6)


def test_the_handouts_metal_does_not_take_the_place_of_a_layer(f32):
    assert not MicrofacetBRDF().describes(layered(0.5, 0.04, 0.3).materials[0], float)
    assert MicrofacetBRDF().describes(Material(F0=0.9, alpha=0.3), float)
