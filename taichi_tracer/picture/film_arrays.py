"""The content of a film as arrays, for checkpoints and for films of other processes."""

from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.system.errors import InputError


def arrays_of(film: Any) -> dict[str, np.ndarray]:
    """The sums of a ``Film``.

    Returns:
        values: [x, y, i] RGB vectors in the running precision; i runs over the total and the rest of half 0, the
            same of half 1 if there is one, and the deviation if it is kept.
        counts: [x, y, 0] the number of all samples, [x, y, 1] that of half 1, 0 if there is none; int32.
        non_finite: (1 + MAX_LOCATED, 3) int32: how many samples were not finite, then (x, y, sample index) of each.
        scale: [x, y] of the deviation; only if it is not 1 everywhere.
        largest: [x, y] the largest sample, in the running precision; only with two halves, and not 0 everywhere.
        before: [x, y] RGB vectors in the running precision, the mean of the first half of half 0; only of one sequence.
        residues: [x, y, half] RGB vectors in the running precision; only if they are not 0 everywhere.
        Beside these, ``Film.to_arrays`` has those of ``Film.unseen``.
    """
    read = film.memory.read
    sums = film.total.read(film.memory), film.rest.read(film.memory)
    pairs = np.stack(sums, axis=3)  # [x, y, half, total or rest, channel]
    values = pairs.reshape(film.width, film.height, 2 * film.halves, 3)
    if film.keeps_deviation:
        values = np.concatenate([values, read(film.deviation)[:, :, None]], axis=2)
    counts = np.zeros((film.width, film.height, 2), np.int32)
    counts[..., 0] = film.counts()
    counts[..., 1 : film.halves] = film.half_count.read(film.memory)[..., 1:]
    arrays = {"values": values, "counts": counts, "non_finite": film.non_finites.to_array()}
    residues = read(film.residue)
    if residues.any():
        arrays["residues"] = residues
    if film.keeps_deviation and (read(film.scale) != 1).any():
        arrays["scale"] = read(film.scale)
    if film.halves == 2 and (largest := film.largest.read(film.memory)[..., 0]).any():
        arrays["largest"] = largest
    if film.doubles:
        arrays["before"] = film.before.read(film.memory)[:, :, 0]
    return arrays


def check_kind(film: Any, arrays: dict[str, np.ndarray], source: str | Path) -> None:
    """Raise an InputError, which begins with ``source``, if the samples of the arrays are not of one sequence."""
    if film.doubles and "before" not in arrays:
        raise InputError(f"{source}: its samples are of two sequences for each pixel, and not of one: begin a new file")


def restore(film: Any, arrays: dict[str, np.ndarray]) -> None:
    """Give a ``Film`` the content of ``arrays_of``, to the last bit."""
    check_kind(film, arrays, "film")
    values, counts = arrays["values"], arrays["counts"]
    pairs = values[:, :, : 2 * film.halves].reshape(film.width, film.height, film.halves, 2, 3)
    half_counts = np.stack([counts[..., 0] - counts[..., 1], counts[..., 1]], axis=2)
    parts = [
        (film.total, pairs[:, :, :, 0]),
        (film.rest, pairs[:, :, :, 1]),
        (film.count, counts[..., :1]),
        (film.half_count, half_counts[..., : film.halves]),
    ]
    if film.halves == 2:
        largest = arrays.get("largest", np.zeros(counts.shape[:2], values.dtype))
        parts.append((film.largest, largest[..., None]))
    if film.doubles:
        parts.append((film.before, arrays["before"][:, :, None]))
    for numbers, array in parts:
        numbers.write(film.memory, array)
    film.memory.write(film.residue, arrays.get("residues", np.zeros_like(pairs[:, :, :, 0])))
    if film.keeps_deviation:
        film.memory.write(film.deviation, values[:, :, -1])
        film.memory.write(film.scale, arrays.get("scale", np.ones(counts.shape[:2], values.dtype)))
    film.non_finites.from_array(arrays["non_finite"])
