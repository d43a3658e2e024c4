"""Light of which each sample finds little: how much of it a picture is most likely missing.

A sample of pixel i finds this light with the probability P, and it adds the light E to the pixel on average. If n
samples per pixel have most likely not found it, E is missing there. Light that is about as rare is counted together
over the whole picture: of many rare things, samples know enough. The mean square error grows by

    u² = (1/N) Σ_i (Σ E)²,

a sum over the pixels, and over the light that is missing in each of them.
"""

import math

import numpy as np

from taichi_tracer.unseen.unseen_light import ABOUT_AS_RARE, KNOWN, expected


class RareLight:
    """Some light of a picture that samples find rarely.

    Attributes:
        pixel: (n,) the number of a pixel. chance: (n,) P, with which a sample of the pixel finds the light. light: (n,)
            E, the root mean square of the channels. pixels: N. each: which part of one find each row stands for.
    """

    def __init__(
        self, pixel: np.ndarray, chance: np.ndarray, light: np.ndarray, pixels: int, each: float = 1.0
    ) -> None:
        self.pixel, self.chance, self.light, self.pixels, self.each = pixel, chance, light, pixels, each

    def missed(self, samples: float) -> float:
        """u in the unit of the picture, for a picture with so many samples per pixel."""
        found = expected(np.sort(self.chance), ABOUT_AS_RARE * self.chance, self.each)
        is_missed = samples * found < KNOWN
        of_pixel = np.bincount(self.pixel[is_missed], self.light[is_missed])
        return math.sqrt(float(np.square(of_pixel).sum()) / self.pixels)


def none_in(pixels: int) -> RareLight:
    """No such light in a picture with so many pixels."""
    return RareLight(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), pixels)
