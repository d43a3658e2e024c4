"""Adaptive sampling: more samples where the picture is noisier.

For a given total number of independent samples, the error of a picture is smallest if every pixel takes samples in
proportion to the standard deviation of one of its samples (Neyman 1934). A pilot with its own random numbers estimates
this deviation. The samples of the pilot are then thrown away. Therefore the number of samples of a pixel does not
depend on the samples that are added up in it, and its mean is unbiased. Sampling each pixel "until it looks good" would
be biased, because it stops early where the first samples happen to agree (Kirk & Arvo, "Unbiased sampling techniques
for image synthesis", SIGGRAPH 1991).

Nobody has to ask for it. A long picture that is rendered to an error or for a time is its own pilot: after 8, 16, 32 …
samples, ``gain_of`` predicts how many times fewer it would need with shares. If that is enough, the picture begins
again, with other random numbers. Otherwise it goes on, and nothing is lost. This choice does depend on samples that may
stay in the picture, but only a little on those of any single pixel.
"""

from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.system import memory

GROUP = 4  # pixels along each side of a group, which have one share
SHARE_BITS = 15
WHOLE = 1 << SHARE_BITS  # the share of a pixel that takes a sample in every pass
PILOT = 8  # samples per pixel in the pilot
SMALLEST = 1 / 4  # of the mean share: a pixel has at least this one. The pilot may have missed its noise.
# A share goes with this power of the variance. It would be 1/2 if the variance fell as 1/n; but that of pixels at
# edges, which is large at first, falls as n^(-3/2), for which the best power is 1 / (1 + 3/2).
POWER = 0.4
LEAST_MEAN = 1 / 64  # the smallest mean of the shares
ROUNDS = 16  # of the search for shares that are neither too small nor too few
# A picture that nobody asked to be adaptive begins again if the samples to come become fewer by this factor, although
# those so far are thrown away; it looks at its samples from this number on. So many samples must be saved in all.
LEAST_GAIN, FIRST_LOOK = 1.5, 8
MUCH = 1 << 23
OTHER_SEED = 0x9E3779B9  # combined with the seed of a picture with shares: its pilot has other random numbers
QUIET = 1e-3  # times the mean variance: a group below this counts as free of noise, whatever its samples cost


@ti.data_oriented
class Shares:
    """The share of the passes in which each pixel takes a sample, in units of 1/``WHOLE``; at first, it is 1.

    The pixels of a group have the same share.

    Args:
        width, height: size of the picture in pixels.

    Attributes:
        are_uneven: whether the pixels have got shares. mean: of all shares, as a fraction.
        gain: how many times fewer samples were predicted with them; 1 if nobody did.
    """

    def __init__(self, width: int, height: int) -> None:
        self._memory, (self.share,) = memory.filled(np.full((width, height), WHOLE), indices=2)
        self.are_uneven, self.mean, self.gain = False, 1.0, 1.0

    def set(self, shares: np.ndarray, gain: float = 1.0) -> None:
        """Set the (height, width) shares of the pixels, top row first, in units of 1/``WHOLE``."""
        self._memory.write(self.share, shares[::-1].T)
        self.mean = float(shares.mean()) / WHOLE
        self.are_uneven, self.gain = True, gain

    def reset(self) -> None:
        """Let all pixels take all samples again."""
        if self.are_uneven:
            self.set(np.full_like(self.to_image(), WHOLE))
            self.are_uneven = False

    def to_image(self) -> np.ndarray:
        """What ``set`` was given."""
        return self._memory.read(self.share).T[::-1].astype(np.int32)

    def seed_of(self, seed: int) -> int:
        """The seed of the samples, for a seed of the picture."""
        return seed ^ OTHER_SEED if self.are_uneven else seed

    def range_of(self, x: int, y: int, first: int, end: int) -> tuple[int, int]:
        """The first index and the end of the samples that a pixel takes in the passes from ``first`` to ``end``."""
        share = int(self.share[x, y])
        first, end = (index * share + WHOLE - 1 >> SHARE_BITS for index in (first, end))
        return first, end

    @ti.func
    def sample_of(self, x, y, index):
        """(the index of the next sample of a pixel, whether the pixel takes it in this pass)."""
        # index · share / WHOLE, rounded up, so that all pixels take a sample in the first pass; the product of two
        # halves has no more than 32 bits.
        share, high, low = ti.cast(self.share[x, y], ti.u32), index >> SHARE_BITS, index & (WHOLE - 1)
        product = low * share
        rest = product & (WHOLE - 1)
        return high * share + (product + (WHOLE - 1) >> SHARE_BITS), rest == 0 or rest + share > WHOLE

    def receipt(self) -> list[str]:
        """One line, if the picture began again with shares by itself."""
        text = f"more samples where noise is larger, as the first showed: {self.gain:.1f} times fewer are predicted"
        return [f"{'pixels':<15} {text}"] if self.gain > 1 else []


def adapt(renderer: Any) -> Any:
    """Render the pilot, and set the share of every pixel. Returns the ``Progress`` of the pilot."""
    first, renderer.first_sample, renderer.adaptive = renderer.first_sample, 0, False
    try:
        renderer.render(PILOT, watch=lambda _: None)
    finally:
        renderer.first_sample, renderer.adaptive = first, True
    begin_with(renderer, shares_of(deviation_of(renderer.film)))
    return renderer.progress


def begin_with(renderer: Any, shares: np.ndarray, gain: float = 1.0) -> None:
    """Begin a picture again with (h, w) shares of its pixels."""
    renderer.reset()
    renderer.shares.set(shares, gain)


def begins_again(renderer: Any, progress: Any) -> bool:
    """Begin a picture again with shares of its pixels, if that is predicted to gain enough in the rest of its time.

    Args:
        progress: of the present call of ``render``. A picture that it has only continued goes on.
    """
    n = renderer.film.samples
    may_be = renderer.adaptive is None and renderer.film.doubles and not renderer.shares.are_uneven
    if not may_be or not n == progress.samples >= FIRST_LOOK or n & (n - 1) != 0:
        return False
    left = progress.samples_to_come
    if not left > n:  # it may be NaN
        return False
    deviation = deviation_of(renderer.film)
    with_shares = (n + left) / max(gain_of(deviation), 1.0)
    saved = (left - with_shares) * np.isfinite(deviation).sum()
    pays = left >= LEAST_GAIN * with_shares and saved >= MUCH
    if pays:
        begin_with(renderer, shares_of(deviation), left / with_shares)
    return pays


def deviation_of(film: Any) -> np.ndarray:
    """(h, w) the standard deviation of the mean of every pixel, of all channels together; NaN where it is unknown."""
    return np.sqrt(film.variance_of_mean().sum(axis=2))


def gain_of(deviation: np.ndarray) -> float:
    """How many times fewer samples a picture needs to the same error if its pixels have shares.

    With the shares s of the groups and their variances v, the gain is Σ v Σ 1 / (Σ v/s Σ s). Chance alone makes v
    uneven. Therefore one half of the pixels of each group chooses the shares, and the other half estimates v. Groups
    without noise are left out: where eye rays hit nothing, samples cost so little that leaving them out gains nothing.

    Args:
        deviation: (h, w) in proportion to the standard deviation of the mean of every pixel; NaN where it is unknown.
    """
    y, x = np.indices(deviation.shape)
    halves = [variance_of_groups(np.where((x + y) % 2 == k, deviation, np.nan)) for k in range(2)]
    both = np.nan_to_num(halves).sum(axis=0)
    is_noisy = (both > QUIET * both.mean()) & np.isfinite(halves).all(axis=0)
    if not is_noisy.any():
        return 0.0
    gains = []
    for chooses, estimates in (halves, halves[::-1]):
        s, v = shares_in(chooses)[is_noisy], estimates[is_noisy]
        gains.append(float(v.sum() * v.size / ((v / s).sum() * s.sum())))
    return min(gains)


def shares_of(deviation: np.ndarray) -> np.ndarray:
    """(h, w) int32 shares in units of 1/``WHOLE``, from the (h, w) standard deviation of every pixel.

    All pixels of a group have one share: a pixel's few samples in the pilot may have missed what its neighbours met. A
    pixel whose deviation is NaN, because it takes no samples, has the mean share.
    """
    height, width = deviation.shape
    share = shares_in(variance_of_groups(deviation))
    shares = np.kron(share, np.ones((GROUP, GROUP)))[:height, :width][::-1]
    return np.ceil(np.where(np.isfinite(deviation), shares, np.nanmean(share)) * WHOLE).astype(np.int32)


def shares_in(variance: np.ndarray) -> np.ndarray:
    """The shares of the groups, at most 1, from their variance; NaN where that is NaN.

    Half of the variance that counts is that of the eight groups around: an edge in one of them goes on in the next one.
    The largest share is 1. If few groups have much more noise than all others, so many have it that the mean share is
    ``LEAST_MEAN``: a pass in which few pixels take samples takes hardly less time.
    """
    if not np.nanmax(variance) > 0:
        return np.where(np.isnan(variance), np.nan, 1.0)
    rows, columns = variance.shape
    padded = np.pad(np.nan_to_num(variance), 1, mode="edge")
    nine = sum(padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3))
    wanted = (variance / 2 + (nine - np.nan_to_num(variance)) / 16) ** POWER
    wanted = share = wanted / np.nanmax(wanted)
    for _ in range(ROUNDS):
        wanted = wanted * max(1.0, LEAST_MEAN / np.nanmean(share))
        share = np.maximum(np.minimum(wanted, 1), SMALLEST * np.nanmean(share))
    return share


def variance_of_groups(deviation: np.ndarray) -> np.ndarray:
    """The mean square of (h, w) deviations, top row first, over the 4 × 4 pixels of each group, the lowest row first.

    Pixels whose deviation is NaN are left out; NaN if all of a group are.
    """
    height, width = deviation.shape
    square = np.pad(np.square(deviation[::-1]), ((0, -height % GROUP), (0, -width % GROUP)), constant_values=np.nan)
    square = square.reshape(square.shape[0] // GROUP, GROUP, -1, GROUP)
    count = np.isfinite(square).sum(axis=(1, 3))
    return np.where(count > 0, np.nansum(square, axis=(1, 3)) / np.maximum(count, 1), np.nan)
