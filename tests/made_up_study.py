"""Studies that nobody has measured, for tests of what is made of a study."""

import math

import numpy as np

from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.studies.convergence import Block, Curve, Shown, Study, Truth
from taichi_tracer.studies.source import SceneFacts
from taichi_tracer.studies.variants import Variant


def found_of(samples, errors) -> dict:
    """``Curve.found`` of an array of errors (seeds, K), which the pictures tell of themselves."""
    return {
        seed + 1: {int(n): (e, e) for n, e in zip(samples, row, strict=True) if not math.isnan(e)}
        for seed, row in enumerate(np.asarray(errors, float))
    }


def made_curve(power=-0.5, scale=1.0, per_sample=0.01, variant=None, k=7, spread=(1.0, 1.0, 1.0)) -> Curve:
    """The error is scale · seconds^power · spread, with a factor of the spread for each seed."""
    samples = 2 ** np.arange(1, k + 1)
    errors = np.outer(spread, scale * (samples * per_sample) ** power)
    blocks = [Block(turn, 16, 16 * per_sample) for turn in range(5)]
    return Curve(
        variant or Variant(), 1.0, per_sample, found=found_of(samples, errors), blocks=blocks, shift_error=0.001
    )


def shown(value: float, side: int, error: float = 0.0) -> Shown:
    """An even picture, but for one pixel."""
    image = np.full((side, side, 3), value)
    image[2, 3] += 0.1
    return Shown(image, 16, error, 0.01, 0.02)


def made_truth(image, error=0.0) -> Truth:
    """A reference without variance."""
    image = np.asarray(image, float)
    return Truth(image, RelativeError(error, 0.9 * error, 1.1 * error), np.zeros_like(image), 100)


def made_study(*curves, side=8, **options) -> Study:
    """A study of some curves."""
    for curve in curves:
        curve.shown = curve.shown or shown(1.0, side)
    facts = SceneFacts("box under studio", "box.obj", "a machine", 2, True, 40, 0.4)
    truths = {"nearest": made_truth(np.ones((side, side, 3)), 0.001)}
    return Study(facts, (side, side), 60.0, 3, list(curves), truths, equal_seconds=0.3, **options)
