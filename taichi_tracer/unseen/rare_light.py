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
NONE = np.zeros((0, 3))  # no light of a kind; each row has the number of a pixel, P, and E: see ``rows_of``


def rows_of(pixel: np.ndarray, chance: np.ndarray, light: np.ndarray) -> np.ndarray:
    """(n, 3) rows of one kind of light that samples find rarely.

    Args:
        pixel: (n,) the number of a pixel. chance: (n,) P, with which a sample of the pixel finds the light; if rows are
            parts of one find, it is divided among them. light: (n,) E, the root mean square of the channels.
    """
    return np.stack([pixel, chance, light], axis=1)


def of_kinds(found: Sequence[np.ndarray]) -> np.ndarray:
    """(n, 4) the rows of several kinds of light in one array, each after the number of its kind."""
    return np.concatenate([np.insert(one, 0, k, axis=1) for k, one in enumerate([NONE, *found])])


def missed(rows: np.ndarray, samples: float, shares: np.ndarray) -> float:
    """u of several kinds of light, each of which is counted by itself; see ``of_kinds``.

    Args:
        samples: per pixel. shares: (pixels,) the share of them that each pixel took.
    """
    kind, pixel, chance, light = rows.T
    with np.errstate(divide="ignore"):  # of light that is never found, P is 0
        brightness = np.round(np.log(light / chance) / math.log(ABOUT_AS_BRIGHT))
    chance = chance * shares[pixel.astype(np.int64)]
    _, group = np.unique(np.stack([kind, brightness], axis=1), axis=0, return_inverse=True)
    is_missed = np.zeros(len(rows), bool)
    for k in np.unique(group):
        own = group.ravel() == k
        is_missed[own] = samples * expected(chance[own]) < KNOWN
    of_pixel = np.bincount(pixel[is_missed].astype(np.int64), light[is_missed])
    return math.sqrt(float(np.square(of_pixel).sum()) / len(shares))


def expected(chance: np.ndarray) -> np.ndarray:
    """(n,) how many samples meet what is about as rare as each of n things, or rarer, for one sample per pixel.

    Args:
        chance: (n,) the probabilities with which a sample meets each.
    """
    rare_first = np.sort(chance)
    total = np.concatenate([[0.0], np.cumsum(rare_first)])
    return total[np.searchsorted(rare_first, ABOUT_AS_RARE * chance, side="right")]
