"""How different are two pictures? Numbers over linear radiance, and one for what people see."""

import numpy as np

from taichi_tracer.files.srgb import srgb_from_linear
from taichi_tracer.system.errors import InputError

PBRT_EPSILON = 0.01  # keeps pixels that are nearly black from deciding the mean, as in the imgtool of pbrt


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
