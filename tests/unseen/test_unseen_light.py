"""The bound of light that no sample met."""

import math

import numpy as np
import pytest
from scipy import stats

from taichi_tracer.unseen.near_misses import EYE, KINDS, LOBE, MIRROR, NearMisses
from taichi_tracer.unseen.unseen_light import KNOWN, SAFETY, UnseenLight, unseen_light

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


@pytest.mark.parametrize("met", range(KNOWN))
def test_no_more_is_missing_than_chance_could_hide_and_nothing_where_directions_are_not_even(met):
    """If M + K look-ups are expected, K or fewer meet the sun with a probability of 5 %."""
    upper = stats.chi2.ppf([0.95, 0.999], 2 * met + 2) / 2
    expected = SAFETY * (upper[0] - met) * 37.5 / math.sqrt(20)
    for near in (100 * upper[0], 100 * upper[1] - 10):
        assert unseen_light(counted(MIRROR, int(near), met), 16, 1.0) == pytest.approx(expected, rel=2e-3)
    assert unseen_light(counted(MIRROR, int(100 * upper[1]) + 10, met), 16, 1.0) == 0  # a flat mirror beside the sun


def test_levels_and_kinds_add_as_squares():
    several = NearMisses(
        np.array([[1000.0, 0.01], [10.0, 0.1]]), np.full((2, 3), 5), np.zeros((2, 3), int), np.ones(SHAPE)
    )
    alone = []
    for level in range(2):
        for kind in range(3):
            near = np.zeros((2, 3))
            near[level, kind] = 5
            alone.append(unseen_light(NearMisses(several.levels, near, several.met, several.per_pixel), 4, 1.0))
    assert unseen_light(several, 4, 1.0) == pytest.approx(math.hypot(*alone))


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
