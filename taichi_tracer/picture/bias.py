"""Do pictures have the mean of a reference?"""

import math

import numpy as np

BLOCK_SIDE = 8  # pixels: the side of the blocks on which the bias is tested
MOST_OF_A_BLOCK = 3.0  # the largest z-score with which a block counts, so that one rare light cannot decide the test


def shift_of(
    pictures: list[tuple[np.ndarray, np.ndarray]], reference: tuple[np.ndarray, np.ndarray], unseen: float = 0.0
) -> tuple[float, float, float]:
    """How the mean of pictures differs from that of the reference.

    Args:
        pictures: (picture, variance of its pixels) for every seed. reference: its picture and variance.
        unseen: what light that no sample met may add, as a fraction of the mean.

    Returns:
        The shift and its standard error, as fractions of the reference's mean; and a z-score. For this one, the
        difference of every block of pixels is divided by its own standard error. A single block counts at most as
        ``MOST_OF_A_BLOCK``, so that one pixel that met a rare light cannot look like a bias, while an estimator that is
        wrong is so in many blocks. The z-score is no larger than that of the whole picture.
    """
    true, variance_of_true = reference
    mean = float(true.mean())
    difference = np.mean([p for p, _ in pictures], axis=0) - true
    variance = np.sum([np.nan_to_num(v) for _, v in pictures], axis=0) / len(pictures) ** 2
    variance += np.nan_to_num(variance_of_true)
    spread = variance.sum(axis=2) / 3  # channels err together
    shift = float(difference.mean()) / mean
    error = math.hypot(math.sqrt(spread.mean() / spread.size) / mean, unseen)
    d, v = (blocks_of(values) for values in (difference.mean(axis=2), spread))
    side = min(BLOCK_SIDE, *difference.shape[:2])
    certain = v > 0
    if not certain.any() or error == 0:
        return shift, error, math.nan
    z = d[certain] / np.sqrt(v[certain] / side**2)
    of_blocks = float(np.clip(z, -MOST_OF_A_BLOCK, MOST_OF_A_BLOCK).sum()) / math.sqrt(z.size)
    return shift, error, math.copysign(min(abs(of_blocks), abs(shift) / error), of_blocks)


def blocks_of(values: np.ndarray) -> np.ndarray:
    """The means of square blocks of (h, w) values; what is left over at the ends is not in them."""
    side = min(BLOCK_SIDE, *values.shape)
    height, width = (n // side for n in values.shape)
    return values[: height * side, : width * side].reshape(height, side, width, side).mean(axis=(1, 3)).ravel()
