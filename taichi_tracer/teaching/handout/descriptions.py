"""Describes an error that no known mistake explains: mirrored, transposed, scaled or moved."""

import math
from collections.abc import Iterator

import numpy as np

from taichi_tracer.teaching.base import Arrays

TOLERANCE = 1e-3  # of a relation such as "always twice as large"
# Factors with a name, for "scaled by".
KNOWN = {math.pi: "π", 1 / math.pi: "1/π", 2 * math.pi: "2π", 1 / (2 * math.pi): "1/(2π)", 180 / math.pi: "180/π"}
KNOWN |= {math.pi / 180: "π/180"} | {1 / n: f"1/{n}" for n in range(2, 10)}
AXES = "xyzw"


def describe(answers: Arrays, expected: Arrays, is_right: np.ndarray) -> list[str]:
    """Sentences about how the answers differ from the expected ones; at least one.

    Args:
        is_right: (n,) which answers are right.
    """
    missing = [name for name in expected if np.shape(answers.get(name)) != np.shape(expected[name])]
    if missing or len(is_right) != len(next(iter(expected.values()))):
        return [f"the answer {missing[0]!r} has another shape than it should" if missing else "the answer is wrong"]
    texts, rows = [], ~is_right
    if "is_hit" in expected:
        yours, right = answers["is_hit"] != 0, expected["is_hit"] != 0
        missed, invented = (right & ~yours).sum(), (yours & ~right).sum()
        texts += [f"{missed} hits are missed"] * bool(missed)
        texts += [f"{invented} rays hit something, although they should miss"] * bool(invented)
        rows = rows & yours & right
    for name, right in expected.items():
        y, r = np.asarray(answers[name])[rows], np.asarray(right)[rows]
        if not np.array_equal(y, r) and not near(y, r):
            texts.append(f"{name} {difference(y, r)}")
    return texts or ["the numbers differ in no way that is known"]


def difference(yours: np.ndarray, right: np.ndarray) -> str:
    """In words how (n, …) numbers differ, all of which belong to wrong answers."""
    y, r = (numbers.reshape(len(right), -1).astype(np.float64) for numbers in (yours, right))
    if not np.isfinite(y).all():
        return f"is not a finite number in {int((~np.isfinite(y)).any(axis=1).sum())} of {len(y)} cases"
    if right.ndim == 3 and right.shape[1] == right.shape[2] and near(np.swapaxes(yours, 1, 2), right):
        return "is transposed"
    for text, numbers in guesses(y, r):
        if near(y, numbers):
            return text
    return f"is wrong by up to {abs(y - r).max():.3g}"


def guesses(y: np.ndarray, r: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """What is often wrong with (n, k) numbers r, in words, and the numbers that it would give; y are the student's."""
    k, axes = r.shape[1], range(r.shape[1] if 1 < r.shape[1] <= len(AXES) else 0)
    yield "is always 0", 0 * r
    if not near(r, np.broadcast_to(r[:1], r.shape)):
        yield "is the same for every input", np.broadcast_to(y[:1], r.shape)
    yield "has the opposite sign" if k == 1 else "points the opposite way", -r
    for i in axes:
        yield f"is mirrored: its {AXES[i]} has the opposite sign", r * np.where(np.arange(k) == i, -1, 1)
        for j in range(i):
            order = [{i: j, j: i}.get(axis, axis) for axis in range(k)]
            yield f"has its {AXES[j]} and its {AXES[i]} exchanged", r[:, order]
    factor = float((y * r).sum() / max((r * r).sum(), 1e-300))
    word = next((word for value, word in KNOWN.items() if abs(factor / value - 1) < TOLERANCE), f"{factor:.4g}")
    yield f"is scaled by {word}", factor * r
    moved = (y - r).mean(axis=0)
    yield f"has a constant offset: {', '.join(f'{number:.4g}' for number in moved)}", r + moved
    yield "has the right direction, but not the length 1", r * np.linalg.norm(y, axis=1, keepdims=True)
    yield "is 1 minus the right number", 1 - r
    for i in axes:
        yield f"is right but for its {AXES[i]}", np.where(np.arange(k) == i, y, r)


def near(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether all numbers agree up to rounding."""
    return np.allclose(a, b, rtol=TOLERANCE, atol=TOLERANCE)
