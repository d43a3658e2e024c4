"""Fresnel's equations and Snell's law against numpy, from grazing to normal incidence, into and out of glass."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.fresnel import fresnel_dielectric, refracted
from taichi_tracer.system import runtime

ETAS = [1.0, 1.0003, 1.4, 2.4, 1 / 1.4, 1 / 2.4]


@ti.kernel
def run(cosine: ti.types.ndarray(ndim=1), eta: float, out: ti.types.ndarray(ndim=2)):
    for i in range(cosine.shape[0]):
        c = cosine[i]
        w_o, n = tm.vec3(ti.sqrt(1 - c * c), 0, c), tm.vec3(0, 0, 1)
        out[i, 0] = fresnel_dielectric(c, eta)
        w = refracted(w_o, n, c, eta)
        for k in ti.static(range(3)):
            out[i, 1 + k] = w[k]


@pytest.mark.parametrize("eta", ETAS)
def test_reflected_share_and_direction(precision, eta):
    """The share from the amplitudes of both polarisations, in complex numbers, which know total reflection."""
    dtype = runtime.dtype()
    cosine = np.linspace(0, 1, 301).astype(dtype)
    out = np.zeros((len(cosine), 4), dtype)
    run(cosine, eta, out)
    c = cosine.astype(np.float64)
    sine = np.sqrt(1 - c * c)
    behind = np.sqrt(1 - (sine / eta) ** 2 + 0j)
    with np.errstate(invalid="ignore"):
        s, p = (c - eta * behind) / (c + eta * behind), (eta * c - behind) / (eta * c + behind)
    expected = (np.abs(s) ** 2 + np.abs(p) ** 2) / 2
    expected[~np.isfinite(expected)] = 1
    steep = np.abs((sine / eta) ** 2 - 1) > 1e-4  # beside the angle of total reflection, the share is steep
    np.testing.assert_allclose(out[steep, 0], expected[steep], atol=3e-4 if dtype == np.float32 else 1e-9)
    passes = (sine / eta < 0.999) & (out[:, 0] < 1)
    w = out[passes, 1:].astype(np.float64)
    np.testing.assert_allclose(-w[:, 0], sine[passes] / eta, atol=1e-5)
    assert (w[:, 2] < 0).all()
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=1e-6)
