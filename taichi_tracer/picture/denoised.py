"""A picture without its noise or its fireflies, and what that costs: its error is measured with other samples.

Open Image Denoise (the extra ``denoise``) guesses the picture f(I) from the noisy one I, with the albedo and the
normals of what the pixels show as guides. A clamp cuts what is much brighter than all around. Both take noise away and
add bias. No estimate of the noise shows this bias. But the samples of a picture have two independent halves with the
means A and B. f(A) knows nothing of B, and B has no bias, so that

    E (f(A) − B)² = e² + V,

where e² is the mean square error of f(A), with its bias, and V is the variance of B, which is E (A − B)² / 2. The
variance of f(A) is E (f(A) − f(B))² / 2; what it does not explain of e² is the square of the bias. All this is of half
of the samples; the changed picture of all of them is mostly better.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from taichi_tracer.files.images import Picture
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.sampler import Sampler
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.importing import import_extra

EXTRA = 'pip install "taichi_tracer[denoise]"'
SAMPLER = "niederreiter_two"  # whose halves are independent
STANDARD_ERRORS = 2.0
LEAST_CLAMP = 1.0  # times the brightest neighbour: a smaller limit would cut pixels that are as bright as that


class Changed(NamedTuple):
    """A picture that was denoised or clamped. Errors are relative RMSE: fractions of the mean of the picture.

    Attributes:
        image: (h, w, 3) linear.
        how: "denoised" or "clamped".
        error: of what this makes of half of the samples, measured with the other half. high: an upper end of
            it, two standard errors higher.
        bias: the part of the error that more samples would not remove. noise: of the picture before.
    """

    image: Picture
    how: str
    error: float
    high: float
    bias: float
    noise: float

    def __str__(self) -> str:
        about = f"{percent(self.error)}, at most" if self.error > 0 else "at most"
        bias = f"{percent(self.bias)} is bias that this added"
        return f"{self.how}: error {about} {percent(self.high)}, of which {bias}; the noise was {percent(self.noise)}"


def denoised(renderer: Any) -> Changed:
    """What the denoiser makes of a renderer's picture.

    Raises:
        InputError: the denoiser is not installed, or as for ``changed``.
    """
    # The guides are 0 where the eye ray hits nothing.
    found = (np.nan_to_num(np.asarray(renderer.aov(name), np.float32)) for name in ("albedo", "normal"))
    albedo, normal = (np.ascontiguousarray(one) for one in found)

    def without_noise(image: np.ndarray) -> np.ndarray:
        colour = np.ascontiguousarray(image, np.float32)
        return np.asarray(denoiser().denoise(colour, albedo=np.clip(albedo, 0, 1), normal=normal, hdr=True))

    return changed(renderer, without_noise, "denoised")


def clamped(renderer: Any, factor: float) -> Changed:
    """A renderer's picture with no pixel brighter than ``factor`` times the brightest of its eight neighbours.

    Raises:
        InputError: the factor is below 1, or as for ``changed``.
    """
    check_clamp(factor)
    return changed(renderer, lambda image: without_fireflies(np.asarray(image), factor), "clamped")


def check_clamp(factor: float) -> None:
    """An InputError unless a clamp may have this factor."""
    if not LEAST_CLAMP <= factor < math.inf:
        raise InputError(f"clamp must be a number from {LEAST_CLAMP:g} on, not {factor:g}")


def no_halves(how: str, sampler: Sampler) -> InputError:
    """The error for samples without two independent halves, which tell what a change adds."""
    advice = "take two samples or more" if sampler.replicated else f"take the sampler {SAMPLER}"
    return InputError(f"{how}: no two halves of the samples of {sampler.name} tell what this adds: {advice}")


def changed(renderer: Any, change: Callable[[np.ndarray], np.ndarray], how: str) -> Changed:
    """What a function makes of a renderer's picture, with the error of that.

    Raises:
        InputError: the picture is none of light, or the samples have no independent halves.
    """
    if not (renderer.srgb and renderer.is_random):
        raise InputError(f"{how}: {renderer.active.name} is no picture of light with noise")
    halves = renderer.film.half_images()
    if halves is None:
        raise no_halves(how, renderer.sampler)
    own = renderer.film.own_pixels
    mean = float(own(renderer.image()).mean(dtype=np.float64))
    a, b = (own(half).astype(np.float64) for half in halves)
    of_a, of_b = (own(change(half)).astype(np.float64) for half in halves)
    variance = np.square(a - b) / 2
    squares = (np.square(of_a - b) + np.square(of_b - a)) / 2 - variance
    e2 = float(squares.mean())
    doubt = STANDARD_ERRORS * float(squares.mean(axis=2).std()) / math.sqrt(squares[..., 0].size)
    bias2 = e2 - float(np.square(of_a - of_b).mean()) / 2

    def rmse(square: float) -> float:
        return math.sqrt(max(square, 0.0)) / mean if mean > 0 else math.nan

    image = Picture(change(np.asarray(renderer.image())), renderer.srgb)
    return Changed(image, how, rmse(e2), rmse(e2 + doubt), rmse(min(bias2, e2)), rmse(float(variance.mean()) / 2))


def without_fireflies(image: np.ndarray, factor: float) -> np.ndarray:
    """(h, w, 3) float32: pixels are scaled down to ``factor`` times the brightest of their eight neighbours.

    How bright a pixel is, its largest channel says. A picture of one pixel stays as it is.
    """
    brightness = np.pad(image.max(axis=2), 1, constant_values=-math.inf)
    height, width = image.shape[:2]
    places = [(row, column) for row in range(3) for column in range(3) if (row, column) != (1, 1)]
    limit = factor * np.max([brightness[r : r + height, c : c + width] for r, c in places], axis=0)
    own = brightness[1:-1, 1:-1]
    share = np.where((own > limit) & np.isfinite(limit), limit / np.where(own > 0, own, 1), 1)
    return np.ascontiguousarray(image * share[..., None], np.float32)


def denoiser() -> Any:
    """The module of Open Image Denoise; an InputError if it is not installed."""
    return import_extra("pyoidn", f"denoise: Open Image Denoise is not installed: {EXTRA}")
