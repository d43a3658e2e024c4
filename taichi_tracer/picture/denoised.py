"""A picture without its noise, and what that costs: a denoiser blurs, and its error is measured with other samples.

Open Image Denoise (the extra ``denoise``) guesses the picture f(I) from the noisy one I, with the albedo and the
normals of what the pixels show as guides. It takes noise away and adds bias. No estimate of the noise tells of this
bias. But the samples of a picture have two independent halves with the means A and B. f(A) knows nothing of B, and B
has no bias, so that

    E (f(A) − B)² = e² + V,

where e² is the mean square error of f(A), with its bias, and V is the variance of B, which is E (A − B)² / 2. The
variance of f(A) is E (f(A) − f(B))² / 2; what it does not explain of e² is the square of the bias. All this is of half
of the samples; the denoised picture of all of them is mostly better.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from taichi_tracer.files.picture import Picture
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.system.errors import InputError

EXTRA = 'pip install "taichi_tracer[denoise]"'
SAMPLER = "niederreiter_two"  # whose halves are independent
STANDARD_ERRORS = 2.0


class Denoised(NamedTuple):
    """A picture that was denoised. Errors are relative RMSE: fractions of the mean of the picture.

    Attributes:
        image: (h, w, 3) linear.
        error: of what the denoiser makes of half of the samples, measured with the other half. high: an upper end of
            it, two standard errors higher.
        bias: the part of the error that more samples would not remove. noise: of the picture before.
    """

    image: Picture
    error: float
    high: float
    bias: float
    noise: float

    def __str__(self) -> str:
        about = f"{percent(self.error)}, at most" if self.error > 0 else "at most"
        bias = f"{percent(self.bias)} is bias that the denoiser added"
        return f"denoised: error {about} {percent(self.high)}, of which {bias}; the noise was {percent(self.noise)}"


def denoised(renderer: Any) -> Denoised:
    """What the denoiser makes of a renderer's picture.

    Raises:
        InputError: the denoiser is not installed, or the samples have no independent halves.
    """
    halves = renderer.film.half_images()
    if halves is None:
        raise InputError(
            f"denoise: {renderer.sampler.name} has no two halves of samples that tell what the denoiser adds: take the "
            f"sampler {SAMPLER}, and two samples or more"
        )
    guides = guides_of(renderer)
    own = renderer.film.own_pixels
    mean = float(own(renderer.image()).mean(dtype=np.float64))
    a, b = (own(half).astype(np.float64) for half in halves)
    of_a, of_b = (own(without_noise(half, *guides)).astype(np.float64) for half in halves)
    variance = np.square(a - b) / 2
    squares = (np.square(of_a - b) + np.square(of_b - a)) / 2 - variance
    e2 = float(squares.mean())
    doubt = STANDARD_ERRORS * float(squares.mean(axis=2).std()) / math.sqrt(squares[..., 0].size)
    bias2 = e2 - float(np.square(of_a - of_b).mean()) / 2

    def told(square: float) -> float:
        return math.sqrt(max(square, 0.0)) / mean if mean > 0 else math.nan

    image = Picture(without_noise(np.asarray(renderer.image()), *guides), renderer.srgb)
    return Denoised(image, told(e2), told(e2 + doubt), told(min(bias2, e2)), told(float(variance.mean()) / 2))


def guides_of(renderer: Any) -> tuple[np.ndarray, np.ndarray]:
    """(albedo, normal), (h, w, 3) float32; 0 where the eye ray hits nothing."""
    found = (np.nan_to_num(np.asarray(renderer.aov(name), np.float32)) for name in ("albedo", "normal"))
    albedo, normal = (np.ascontiguousarray(one) for one in found)
    return np.clip(albedo, 0, 1), normal


def without_noise(image: np.ndarray, albedo: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(h, w, 3) float32: what Open Image Denoise makes of a picture of light."""
    colour = np.ascontiguousarray(image, np.float32)
    return np.asarray(denoiser().denoise(colour, albedo=albedo, normal=normal, hdr=True))


def denoiser() -> Any:
    """The module of Open Image Denoise; an InputError if it is not installed."""
    try:
        import pyoidn
    except ImportError:
        raise InputError(f"denoise: Open Image Denoise is not installed: {EXTRA}") from None
    return pyoidn
