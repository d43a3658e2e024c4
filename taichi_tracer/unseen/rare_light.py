"""Light of which each sample finds little: how much of it a picture is most likely missing.

A sample of pixel i finds this light with the probability P, and it adds the light E to the pixel on average. If n
samples per pixel have most likely not found it, E is missing there. Light that is about as rare is counted together
over the whole picture: of many rare things, samples know enough. But a dim find says nothing of bright ones, so this
holds only for finds V = E/P that are about as bright. The mean square error grows by

    u² = (1/N) Σ_i (Σ E)²,

a sum over the pixels, and over the light that is missing in each of them.
"""

import math
from collections.abc import Sequence

import numpy as np

ABOUT_AS_RARE = 4.0  # what is up to so many times as probable is counted together
ABOUT_AS_BRIGHT = 4.0  # what is up to so many times as bright is counted together
KNOWN = 10  # samples that met some light: from so many, their spread shows the error
COLUMNS = 5  # of a row: which of several kinds of light it belongs to, pixel, P, E, and the weight of a row


def rows_of(pixel: np.ndarray, chance: np.ndarray, light: np.ndarray, each: float = 1.0) -> np.ndarray:
    """(n, 4) rows of one kind of light that samples find rarely.

    Args:
        pixel: (n,) the number of a pixel. chance: (n,) P, with which a sample of the pixel finds the light. light: (n,)
            E, the root mean square of the channels. each: which part of one find each row represents.
    """
    return np.stack([pixel, chance, light, np.full(len(pixel), each)], axis=1)


NONE = np.zeros((0, COLUMNS - 1))  # no such light


def of_kinds(found: Sequence[np.ndarray]) -> np.ndarray:
    """(n, COLUMNS) the rows of several kinds of light in one array."""
    return np.concatenate([np.zeros((0, COLUMNS)), *(np.insert(one, 0, k, axis=1) for k, one in enumerate(found))])


def missed(rows: np.ndarray, samples: float, shares: np.ndarray) -> float:
    """u of several kinds of light, each of which is counted by itself; see ``of_kinds``.

    Args:
        samples: per pixel. shares: (pixels,) the share of them that each pixel took.
    """
    if len(rows) == 0:
        return 0.0
    kind, pixel, chance, light, each = rows.T
    brightness = np.round(np.log(light / chance) / math.log(ABOUT_AS_BRIGHT))
    chance = chance * shares[pixel.astype(np.int64)]
    _, group = np.unique(np.stack([kind, brightness], axis=1), axis=0, return_inverse=True)
    is_missed = np.zeros(len(rows), bool)
    for k in np.unique(group):
        own = group.ravel() == k
        found = expected(np.sort(chance[own]), ABOUT_AS_RARE * chance[own], each[own][0])
        is_missed[own] = samples * found < KNOWN
    of_pixel = np.bincount(pixel[is_missed].astype(np.int64), light[is_missed])
    return math.sqrt(float(np.square(of_pixel).sum()) / len(shares))


def expected(rare_first: np.ndarray, most: np.ndarray, each: float) -> np.ndarray:
    """How many samples meet what is at most as probable as each of some numbers, for one sample per pixel.

    Args:
        rare_first: the probabilities with which a sample meets something, in order. most: the largest that count.
        each: for how many pixels, or lamps, one probability stands.
    """
    total = np.concatenate([[0.0], np.cumsum(rare_first) * each])
    return total[np.searchsorted(rare_first, most, side="right")]
