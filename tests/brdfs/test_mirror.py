"""The mirror: one direction, with the weight of Phong."""

import numpy as np
import pytest
from oracles import light
from probe import brdf_samples, brdf_values

from taichi_tracer.brdfs.phong import Mirror
from taichi_tracer.materials import Material
from taichi_tracer.system import runtime


def test_it_reflects_into_one_direction(f32):
    w_o = np.array([[0.6, 0.0, 0.8]])
    assert not brdf_values(Mirror(), 1e21, w_o, [[-0.6, 0, 0.8]])[0, :2].any()
    np.testing.assert_allclose(brdf_values(Mirror(), 1e21, w_o, [[-0.6, 0, 0.8]])[0, 2], 0.75 * 0.8, rtol=1e-6)
    assert Mirror.is_delta


def test_every_sample_is_the_mirrored_direction(precision, rng):
    n, w_o = light.to_unit(np.array([1.0, -2.0, 2.0])), light.to_unit(np.array([0.2, -0.9, 0.5]))
    found = brdf_samples(Mirror(), 1e21, w_o, n, rng.random((100, 2)))
    expected = 2 * (n @ w_o) * n - w_o
    np.testing.assert_allclose(found, np.tile(expected, (100, 1)), atol=4 * runtime.epsilon())


@pytest.mark.parametrize(("ns", "is_mirror"), [(1, False), (1e12, False), (1e21, True), (1e36, True)])
def test_a_lobe_narrower_than_f32_is_a_mirrors(ns, is_mirror):
    """C-3. Both precisions mean the same scene."""
    assert Mirror().describes(Material(Ns=ns), np.float32) is is_mirror
    assert Mirror().describes(Material(Ns=ns), np.float64) is is_mirror
