"""Adaptive sampling: more samples where the picture is noisier.

The error of a picture is smallest, for a number of samples, when every pixel takes them in proportion to the standard
deviation of one (Neyman 1934). A pilot estimates that deviation, from random numbers of its own, and is thrown away:
the number of samples of a pixel then depends on nothing that is added up in it, so that its mean is unbiased. Adding
samples "until the pixel looks good" is not: it stops where the first ones happened to agree (Kirk & Arvo, "Unbiased
sampling techniques for image synthesis", SIGGRAPH 1991).
"""

import numpy as np
import taichi as ti

from taichi_tracer.system import memory

SHARE_BITS = 8
WHOLE = 1 << SHARE_BITS  # the share of a pixel that takes a sample in every pass
PILOT = 16  # samples per pixel
PILOT_SEED = 0x9E3779B9  # other random numbers than those of the picture
SMALLEST = 1 / 8  # share of the samples of a pixel in which the pilot saw no noise: it may have missed it
MOST = 0.99  # pixels above this quantile of the deviation take part in every pass: a few would slow down all


@ti.data_oriented
class Shares:
    """In which share of the passes, in 1/256, each pixel takes a sample.

    Args:
        width, height: pixels.
        keeps: False when every pixel takes one in every pass: then nothing is kept, and nothing of it compiled.
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
        """Take the (height, width) shares of the pixels, top row first, in 1/256."""
        self.share.from_numpy(np.ascontiguousarray(shares[::-1].T, np.uint32))
        self.mean = float(shares.mean()) / WHOLE
        self.version += 1

    @ti.func
    def sample_of(self, x, y, index):
        """(index of the sample that a pixel takes in a pass, whether it takes one in this pass)."""
        is_taken = True
        if ti.static(self.are_kept):
            share = self.share[x, y]
            is_taken = ((index + 1) * share >> SHARE_BITS) > (index * share >> SHARE_BITS)
            index = index * share >> SHARE_BITS
        return index, is_taken


def adapt(renderer):
    """Render the pilot, and give every pixel its share of the passes; returns what the pilot took."""
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
    """(h, w) int32 in 1/256 from the (h, w) standard deviation of one sample of every pixel."""
    largest = np.quantile(deviation, MOST)
    share = deviation / largest if largest > 0 else np.ones_like(deviation)
    return np.ceil(np.clip(share, SMALLEST, 1) * WHOLE).astype(np.int32)
