"""How different are two pictures, and is one biased? Numbers over linear radiance, and one for what people see."""

import math

import numpy as np

from taichi_tracer.files.images import srgb_from_linear
from taichi_tracer.picture.film import Film
from taichi_tracer.system.errors import InputError

PBRT_EPSILON = 0.01  # keeps pixels that are nearly black from deciding the mean, as in the imgtool of pbrt
BLOCK_SIDE = 8  # pixels: the side of the blocks on which the bias is tested
MOST_OF_A_BLOCK = 3.0  # the largest z-score with which a block counts, so that one rare light cannot decide the test
BLOCK = 4  # pixels on a side: the variance of one pixel is a rough number, the mean of a block is not


def rmse(image: np.ndarray, reference: np.ndarray) -> float:
    """Root of the mean squared difference over pixels and channels."""
    return float(np.sqrt(np.mean((image.astype(np.float64) - reference) ** 2)))


def relative_rmse(image: np.ndarray, reference: np.ndarray) -> float:
    """RMSE as a fraction of the reference's mean; infinite where that is black and the picture is not."""
    error, mean = rmse(image, reference), abs(float(reference.mean(dtype=np.float64)))
    return error / mean if mean > 0 else (0.0 if error == 0 else float("inf"))


def rel_mse(image: np.ndarray, reference: np.ndarray) -> float:
    """Mean of (x − r)²/(r + 0.01)², pbrt-v4's MRSE: an error in the dark counts as much as one in bright places."""
    return float(np.mean((image.astype(np.float64) - reference) ** 2 / (reference + PBRT_EPSILON) ** 2))


def flip(image: np.ndarray, reference: np.ndarray) -> tuple[float, np.ndarray]:
    """Mean and (h, w) map of FLIP, 0 (the same) to 1: what a viewer sees when the two take turns on a screen.

    Andersson et al., "FLIP: A difference evaluator for alternating images", HPG 2020, for the pictures as a screen
    shows them: clipped to [0, 1], with the sRGB curve, at 67 pixels per degree.
    """
    from flip_evaluator import evaluate

    shown = [srgb_from_linear(np.clip(np.nan_to_num(p, nan=0.0), 0, 1)).astype(np.float32) for p in (reference, image)]
    values, mean, _ = evaluate(*shown, "LDR", inputsRGB=True, applyMagma=False)
    return float(mean), np.asarray(values, np.float64).reshape(image.shape[:2])


def check_same_size(image: np.ndarray, reference: np.ndarray) -> None:
    """Raise InputError where two pictures cannot be compared pixel by pixel."""
    if image.shape != reference.shape:
        sizes = " and ".join(f"{p.shape[1]}x{p.shape[0]}" for p in (image, reference))
        raise InputError(f"pictures of {sizes} pixels cannot be compared: they must be of one size")


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


def blocks_of(values: np.ndarray, side: int = BLOCK_SIDE) -> np.ndarray:
    """(rows, columns, …) means of square blocks of (h, w, …) values; what is left over at the ends is not in them."""
    side = min(side, *values.shape[:2])
    height, width = (n // side for n in values.shape[:2])
    blocks = values[: height * side, : width * side].reshape(height, side, width, side, *values.shape[2:])
    return blocks.mean(axis=(1, 3))


def typical_error(film: Film) -> float:
    """The median, over blocks of pixels with light, of the standard error of a pixel relative to the block's mean.

    A fraction; NaN where it is unknown. In half of the picture, pixels are better than this.
    """
    image = film.own_pixels(film.image()).astype(np.float64).mean(axis=2)
    variance = film.own_pixels(film.variance_of_mean()).astype(np.float64).mean(axis=2)
    blocks = [blocks_of(values, BLOCK) for values in (image, variance)]
    is_lit = (blocks[0] > 0) & np.isfinite(blocks[1])
    return float(np.median(np.sqrt(blocks[1][is_lit]) / blocks[0][is_lit])) if is_lit.any() else math.nan
