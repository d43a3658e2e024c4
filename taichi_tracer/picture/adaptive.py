"""Adaptive sampling: more samples where the picture is noisier.

For a given total number of samples, the error of a picture is smallest if every pixel takes samples in proportion to
the standard deviation of one of its samples (Neyman 1934). A pilot with its own random numbers estimates this
deviation. The samples of the pilot are then thrown away. Therefore the number of samples of a pixel does not depend on
the samples that are added up in it, and its mean is unbiased. Sampling each pixel "until it looks good" would be
biased, because it stops early where the first samples happen to agree (Kirk & Arvo, "Unbiased sampling techniques for
image synthesis", SIGGRAPH 1991).
"""

import numpy as np
import taichi as ti

from taichi_tracer.picture.pixel_groups import GROUP, GROUP_BITS
from taichi_tracer.system import memory

SHARE_BITS = 8
WHOLE = 1 << SHARE_BITS  # the share of a pixel that takes a sample in every pass
PILOT = 8  # samples per pixel in the pilot
PILOT_SEED = 0x9E3779B9  # combined with the seed, so that the pilot has other random numbers than the picture
SMALLEST = 1 / 8  # the smallest share of a pixel: if the pilot saw no noise in it, it may have missed some
# All groups above this quantile of the deviation of single pixels have the share 1. Without it, a few very noisy pixels
# would determine the largest share, and all others would take samples only rarely, and miss light that is rarely met.
MOST = 0.99


@ti.data_oriented
class Shares:
    """The share of the passes in which each pixel takes a sample, in units of 1/256.

    The pixels of a group, see ``pixel_groups``, have the same share.

    Args:
        width, height: size of the picture in pixels.
        keeps: whether there are shares. With False, every pixel takes a sample in every pass; no memory is used, and
            the code for shares is not compiled.
    """

    def __init__(self, width: int, height: int, keeps: bool = False) -> None:
        self.are_kept, self.version, self.mean = keeps, 0, 1.0
        if keeps:
            self._memory = memory.Memory()
            self.share = ti.field(ti.u32)
            self._memory.fields.dense(ti.ij, (width, height)).place(self.share)
            self._memory.allocate()
            self.set(np.full((height, width), WHOLE, np.int32))

    def set(self, shares: np.ndarray) -> None:
        """Set the (height, width) shares of the pixels, top row first, in units of 1/256."""
        self._memory.write(self.share, shares[::-1].T)
        self.mean = float(shares.mean()) / WHOLE
        self.version += 1

    @ti.func
    def sample_of(self, x, y, index):
        """(the index of the next sample of a pixel, whether the pixel takes it in this pass)."""
        is_taken = True
        if ti.static(self.are_kept):
            share = self.share[x, y]
            is_taken = ((index + 1) * share >> SHARE_BITS) > (index * share >> SHARE_BITS)
            index = index * share >> SHARE_BITS
        return index, is_taken

    @ti.func
    def takes_group(self, group_x, group_y, index):
        """Whether the pixels of a group take a sample in this pass; they have one share."""
        _, is_taken = self.sample_of(group_x << GROUP_BITS, group_y << GROUP_BITS, index)
        return is_taken


def adapt(renderer):
    """Render the pilot, and set the share of every pixel. Returns the ``Progress`` of the pilot."""
    seed, first = renderer.seed, renderer.first_sample
    everywhere = np.full((renderer.height, renderer.width), WHOLE, np.int32)
    renderer.shares.set(everywhere)
    renderer.seed, renderer.first_sample, renderer.adaptive = seed ^ PILOT_SEED, 0, False
    try:
        renderer.render(PILOT, watch=lambda _: None)
        deviation = renderer.film.sample_deviation()
        pilot = renderer.progress
    finally:
        renderer.adaptive, renderer.seed, renderer.first_sample = True, seed, first
    renderer.shares.set(shares_of(deviation))
    renderer.reset()
    return pilot


def shares_of(deviation: np.ndarray) -> np.ndarray:
    """(h, w) int32 shares in units of 1/256, from the (h, w) standard deviation of one sample of every pixel.

    All pixels of a group have one share: a pixel's few samples in the pilot may have missed what its neighbours met,
    and fast forms take or leave out whole groups.
    """
    largest = np.quantile(deviation, MOST)
    share = deviation_of_groups(deviation) / largest if largest > 0 else np.ones_like(deviation)
    return np.ceil(np.clip(share, SMALLEST, 1) * WHOLE).astype(np.int32)


def deviation_of_groups(deviation: np.ndarray) -> np.ndarray:
    """(h, w) the root of the mean square of (h, w) deviations over the 4 × 4 pixels of each group, top row first."""
    height, width = deviation.shape
    square = np.pad(np.square(deviation[::-1]), ((0, -height % GROUP), (0, -width % GROUP)), constant_values=np.nan)
    groups = np.nanmean(square.reshape(square.shape[0] // GROUP, GROUP, -1, GROUP), axis=(1, 3))
    return np.sqrt(np.kron(groups, np.ones((GROUP, GROUP)))[:height, :width])[::-1]
