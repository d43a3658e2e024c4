"""The bound of light that no sample met."""

import math

import numpy as np
import pytest

from taichi_tracer.unseen.near_misses import EYE, KINDS, LOBE, MIRROR, NearMisses
from taichi_tracer.unseen.unseen_light import SAFETY, UnseenLight, unseen_light

SHAPE = (4, 5)


def counted(kind, near, met, per_pixel=None):
    """One level of radiance 1000, a hundredth of what is near, with look-ups of one kind."""
    counts = np.zeros((2, 1, len(KINDS)), np.int64)
    counts[0, 0, kind], counts[1, 0, kind] = near, met
    return NearMisses(np.array([[1000.0, 0.01]]), *counts, np.zeros(SHAPE) if per_pixel is None else per_pixel)


def test_nothing_is_unseen_where_nothing_is_counted_near_or_known():
    assert unseen_light(None, 16, 1.0) == 0
    assert unseen_light(counted(MIRROR, 0, 0), 16, 1.0) == 0
    assert unseen_light(counted(MIRROR, 500, 10), 16, 1.0) == 0  # ten hits: the samples know it
    assert unseen_light(counted(MIRROR, 500, 9), 0, 1.0) == 0
    assert unseen_light(counted(MIRROR, 500, 9), 16, 0.0) == 0


@pytest.mark.parametrize("kind", [EYE, MIRROR])
def test_eye_rays_and_mirrors_have_it_in_one_pixel(kind):
    """SAFETY √((λ c)² / N) / mean with λ = (8 + 2) 0.01, c = 0.6 · 1000 / 16 and N = 20."""
    expected = SAFETY * math.sqrt((0.1 * 37.5) ** 2 / 20) / 2.0
    assert unseen_light(counted(kind, 8, 3), 16, 2.0) == pytest.approx(expected)


def test_lobes_have_it_in_as_many_pixels_as_look_near():
    """With 2 near look-ups in each of 10 pixels, N_eff = 20² / (10 · 2) = 20."""
    per_pixel = np.zeros(SHAPE)
    per_pixel.flat[:10] = 2
    expected = SAFETY * math.sqrt((0.22 * 37.5) ** 2 / (20 * 20)) / 2.0
    assert unseen_light(counted(LOBE, 20, 0, per_pixel), 16, 2.0) == pytest.approx(expected)
    one = np.zeros(SHAPE)
    one[1, 2] = 20  # all in one pixel: as with a mirror, but for the pairs, 20² / (20 · 19)
    both = unseen_light(counted(LOBE, 20, 0, one), 16, 2.0), unseen_light(counted(MIRROR, 20, 0), 16, 2.0)
    assert both[0] == pytest.approx(both[1] * math.sqrt(19 / 20))


def test_what_was_counted_is_merged_and_kept():
    first, second = UnseenLight(), UnseenLight()
    assert first.counted() is None
    assert first.to_arrays() == {}
    assert first.bound(16, 1.0) == 0
    second.from_arrays(counted(MIRROR, 8, 3).to_arrays())
    for expected in (8, 16):
        first.merge(second)
        assert first.counted().near[0, MIRROR] == expected
    assert first.bound(16, 2.0) == unseen_light(counted(MIRROR, 16, 6), 16, 2.0)
    first.from_arrays(second.to_arrays())
    assert first.counted().met[0, MIRROR] == 3
    first.reset()
    assert first.counted() is None
