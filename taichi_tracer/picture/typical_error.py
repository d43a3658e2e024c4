"""The error of a typical part of a picture, which a few pixels at edges or fireflies do not decide."""

import math

import numpy as np

from taichi_tracer.picture.film import Film

BLOCK = 4  # pixels on a side: the variance of one pixel is a rough number, the mean of a block is not


def typical_error(film: Film) -> float:
    """The median, over blocks of pixels with light, of the standard error of a pixel relative to the block's mean.

    A fraction; NaN where it is unknown. In half of the picture, pixels are better than this.
    """
    image = film.own_pixels(film.image()).astype(np.float64).mean(axis=2)
    variance = film.own_pixels(film.variance_of_mean()).astype(np.float64).mean(axis=2)
    height, width = (max(BLOCK, BLOCK * (side // BLOCK)) for side in image.shape)
    blocks = [mean_of_blocks(values[:height, :width]) for values in (image, variance)]
    is_lit = (blocks[0] > 0) & np.isfinite(blocks[1])
    return float(np.median(np.sqrt(blocks[1][is_lit]) / blocks[0][is_lit])) if is_lit.any() else math.nan


def mean_of_blocks(values: np.ndarray) -> np.ndarray:
    """The mean of each block of an array whose sides are multiples of ``BLOCK``; of all of it, where it is smaller."""
    height, width = values.shape
    if height % BLOCK or width % BLOCK:
        return values.mean(keepdims=True)
    return values.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).mean(axis=(1, 3))
