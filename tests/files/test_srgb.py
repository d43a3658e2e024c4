"""Bytes of pictures and the sRGB transfer function."""

import numpy as np

from taichi_tracer.files.images import linear_from_srgb, srgb_from_linear, to_bytes


def test_bytes_are_clipped_rounded_and_never_nan():
    values = np.array([-1, 0, 0.49 / 255, 0.51 / 255, 1, 7, np.nan, np.inf, -np.inf])
    assert to_bytes(values).tolist() == [0, 0, 0, 1, 255, 255, 0, 255, 0]


def test_every_byte_survives():
    steps = np.arange(256)
    assert np.array_equal(to_bytes(steps / 255), steps)
    assert np.array_equal(to_bytes(linear_from_srgb(steps / 255), srgb=True), steps)


def test_srgb_has_its_published_values():
    assert np.allclose(srgb_from_linear(np.array([0, 0.001, 0.2140411, 1])), [0, 0.01292, 0.5, 1], atol=1e-6)
    assert np.allclose(linear_from_srgb(np.array([0, 0.04, 0.5, 1])), [0, 0.04 / 12.92, 0.2140411, 1], atol=1e-6)
