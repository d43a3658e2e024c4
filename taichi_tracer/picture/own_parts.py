"""After the first sample of a picture: whether somebody's own parts give numbers at all, and where they do not.

Samples that are not finite are never added, and a ray without a direction hits nothing: the picture would be black
without a word. No ray and no sample is looked at where all parts belong to the package.
"""

import warnings
from typing import Any

import numpy as np

from taichi_tracer.system.errors import NotFiniteWarning, digits_of
from taichi_tracer.system.own_code.checks import is_packages
from taichi_tracer.system.parts import replaced

SIDE = 8  # rays of a camera that are looked at, along each axis
MOST_RAYS, MOST_SAMPLES = 0.5, 0.1  # that are not finite: a larger fraction is a mistake of the part


def note_numbers(renderer: Any) -> None:
    """Note what is wrong with the rays and the samples of own parts."""
    if replaced(renderer.camera):
        note_rays(renderer.camera)
    parts = renderer, renderer.active, renderer.sampler, *renderer.scene_data.parts
    if not all(is_packages(type(part)) and not replaced(part) for part in parts):
        note_samples(renderer)


def note_rays(camera: Any) -> None:
    """Note that most rays of a camera have no direction, with the first pixel of them."""
    places = np.meshgrid(*(np.linspace(0, size - 1, SIDE, dtype=int) for size in (camera.width, camera.height)))
    x, y = (place.ravel() for place in places)
    origins, directions = camera.rays(x, y)
    wrong = ~np.isfinite(np.hstack([origins, directions])).all(axis=1) | (directions == 0).all(axis=1)
    if wrong.mean() > MOST_RAYS:
        k = int(wrong.argmax())
        warnings.warn(
            f"{type(camera).__name__}.generate_ray: the ray of pixel ({x[k]}, {y[k]}) has the origin "
            f"{digits_of(origins[k])} and the direction {digits_of(directions[k])}, and hits nothing",
            stacklevel=4,
        )


def note_samples(renderer: Any) -> None:
    """Note that most samples are not finite, with the first of them."""
    count, of = renderer.non_finite, renderer.width * renderer.height
    if count > MOST_SAMPLES * of:
        x, y, _ = renderer.film.non_finite_samples()[0]
        found = f"{count:,} of {of:,} samples are NaN or infinite, and are not added"
        warnings.warn(f"{renderer.active.name}: {found}; the first at pixel ({x}, {y})", NotFiniteWarning, stacklevel=4)
