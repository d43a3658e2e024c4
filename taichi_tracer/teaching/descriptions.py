"""Describes an error that no known mistake explains: mirrored, transposed, scaled, moved, or wrong in some cases."""

import math

import numpy as np

from taichi_tracer.teaching.base import Arrays

TOLERANCE = 1e-3  # of a relation such as "always twice as large"
# Factors with a name, for "scaled by".
KNOWN = {math.pi: "π", 1 / math.pi: "1/π", 2 * math.pi: "2π", 1 / (2 * math.pi): "1/(2π)", 4 * math.pi: "4π"}
KNOWN |= {1 / (4 * math.pi): "1/(4π)", 180 / math.pi: "180/π", math.pi / 180: "π/180", math.sqrt(2): "√2"}
AXES = "xyzw"
FEW, MANY = 2, 5  # wrong inputs of which nothing general is said, if there are more than so many times as many


def describe(inputs: Arrays, answers: Arrays, expected: Arrays, is_right: np.ndarray) -> list[str]:
    """Sentences about how the answers differ from the expected ones; at least one.

    Args:
        is_right: (n,) which answers are right.
    """
    missing = [name for name in expected if np.shape(answers.get(name)) != np.shape(expected[name])]
    if missing or len(is_right) != len(next(iter(expected.values()))):
        return [f"the answer {missing[0]!r} has another shape than it should" if missing else "the answer is wrong"]
    told = cases(inputs, expected, is_right)
    rows = ~is_right
    if "is_hit" in expected:
        yours, right = answers["is_hit"] != 0, expected["is_hit"] != 0
        missed, invented = (right & ~yours).sum(), (yours & ~right).sum()
        told += [f"{missed} hits are missed"] if missed else []
        told += [f"{invented} rays hit something, although they should miss"] if invented else []
        rows = rows & yours & right
    where = np.flatnonzero(rows)
    for name, right in expected.items() if len(where) else ():
        y, r = np.asarray(answers[name])[where], np.asarray(right)[where]
        if len(where) <= FEW and len(rows) > MANY * len(where):
            told += [] if np.array_equal(y, r) else [at_few(name, y, r, where, len(rows))]
        else:
            told += differences_of(name, y, r)
    return told or ["the numbers differ in no way that is known"]


def cases(inputs: Arrays, expected: Arrays, is_right: np.ndarray) -> list[str]:
    """In which cases alone the answers are wrong."""
    told = []
    back = expected.get("is_backfacing")
    hit = expected.get("is_hit", np.ones(len(is_right))) != 0
    if back is not None:
        back = back != 0
        if not is_right[hit & back].any() and is_right[~back].all() and (hit & back).any():
            told.append("wrong only for hits on the back of a triangle")
        elif not is_right[hit & ~back].any() and is_right[hit & back].all() and (hit & ~back).any():
            told.append("wrong only for hits on the front of a triangle")
    direction = inputs.get("direction")
    if direction is not None and len(direction) == len(is_right):
        is_unit = abs(np.linalg.norm(direction, axis=1) - 1) < 1e-4
        if is_unit.any() and not is_unit.all() and is_right[is_unit].all():
            told.append("wrong only for rays whose direction does not have the length 1")
    return told


def differences_of(name: str, yours: np.ndarray, right: np.ndarray) -> list[str]:
    """How one answer differs, over all rows that are wrong; nothing if it does not."""
    count = len(yours)
    if right.dtype.kind in "iub":
        if np.array_equal(yours, right):
            return []
        offsets = np.unique(yours.astype(np.int64) - right.astype(np.int64))
        if len(offsets) == 1:
            return [f"{name} is always {'too large' if offsets[0] > 0 else 'too small'} by {abs(offsets[0])}"]
        return [f"{name} is wrong in {int((yours != right).reshape(count, -1).any(axis=1).sum())} of {count} cases"]
    y, r = yours.reshape(count, -1).astype(np.float64), right.reshape(count, -1).astype(np.float64)
    if not np.isfinite(y).all():
        return [f"{name} is not a finite number in {int((~np.isfinite(y)).any(axis=1).sum())} of {count} cases"]
    if not np.isfinite(r).all() or near(y, r):
        return []
    square = right.shape[1:] if len(right.shape) == 3 and right.shape[1] == right.shape[2] else None
    if square and near(np.swapaxes(yours, 1, 2).reshape(count, -1), r):
        return [f"{name} is transposed"]
    return [description_of(name, y, r)]


def description_of(name: str, y: np.ndarray, r: np.ndarray) -> str:
    """The first description that fits (n, k) numbers."""
    k = r.shape[1]
    if near(y, 0 * r):
        return f"{name} is always 0"
    if count_of_rows(y) == 1 and count_of_rows(r) > 1:
        return f"{name} is the same for every input"
    if near(y, -r):
        return f"{name} has the opposite sign" if k == 1 else f"{name} points the opposite way"
    if 2 <= k <= 4:
        for i in range(k):
            mirrored = r.copy()
            mirrored[:, i] *= -1
            if near(y, mirrored):
                return f"{name} is mirrored: its {AXES[i]} has the opposite sign"
            for j in range(i + 1, k):
                exchanged = r.copy()
                exchanged[:, [i, j]] = r[:, [j, i]]
                if near(y, exchanged):
                    return f"{name} has its {AXES[i]} and its {AXES[j]} exchanged"
    factor = float((y * r).sum() / max((r * r).sum(), 1e-300))
    if near(y, factor * r):
        return f"{name} is scaled by {factor_word(factor)}"
    if len(r) > 1 and near(y - r, np.broadcast_to((y - r).mean(axis=0), r.shape)):
        moved = ", ".join(f"{number:.4g}" for number in (y - r).mean(axis=0))
        return f"{name} has a constant offset: {moved}"
    if k == 3:
        lengths = np.linalg.norm(y, axis=1, keepdims=True)
        if (lengths > 0).all() and near(y / lengths, r):
            return f"{name} has the right direction, but not the length 1"
    if near(y, 1 - r):
        return f"{name} is 1 minus the right number"
    wrong = [i for i in range(k) if not near(y[:, i], r[:, i])]
    if len(wrong) < k <= 4:
        return f"of {name}, only {' and '.join(AXES[i] for i in wrong)} is wrong"
    if k == 1 and (y < r).all():
        return f"{name} is always too small"
    if k == 1 and (y > r).all():
        return f"{name} is always too large"
    return worst(name, y, r)


def at_few(name: str, yours: np.ndarray, right: np.ndarray, where: np.ndarray, count: int) -> str:
    """Answers that are wrong for one or two inputs alone: which, and how much. ``where`` are their numbers."""
    y, r = (one.reshape(len(where), -1).astype(np.float64) for one in (yours, right))
    inputs = f"input{'s' * (len(where) > 1)} {' and '.join(map(str, where))} of {count}"
    return f"{name} is wrong for {inputs} alone, where {largest(y, r)[1]}"


def worst(name: str, y: np.ndarray, r: np.ndarray) -> str:
    """Where (n, k) numbers that nothing else describes are wrong most, and in which direction."""
    row, told = largest(y, r)
    return f"{name} is wrong: most for number {row + 1} of {len(r)} wrong inputs, where {told}"


def largest(y: np.ndarray, r: np.ndarray) -> tuple[int, str]:
    """The row of (n, k) numbers with the largest difference, and in words which number it is, and how far off."""
    row, column = np.unravel_index(np.nan_to_num(abs(y - r), nan=np.inf).argmax(), r.shape)
    off = y[row, column] - r[row, column]
    part = f"its {AXES[column]}" if 1 < r.shape[1] <= 4 else "it" if r.shape[1] == 1 else f"its number {column}"
    return int(row), f"{part} is too {'large' if off > 0 else 'small'} by {abs(off):.3g}"


def near(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether all numbers agree up to rounding."""
    return bool((abs(a - b) <= TOLERANCE * np.maximum(1, abs(b))).all())


def count_of_rows(rows: np.ndarray) -> int:
    """How many different rows there are, up to rounding."""
    return len(np.unique(rows.round(5), axis=0))


def factor_word(factor: float) -> str:
    """A factor as a student would write it."""
    for value, word in KNOWN.items():
        if abs(factor / value - 1) < TOLERANCE:
            return word
    if factor != 0 and abs(factor) < 1 and abs(1 / factor - round(1 / factor)) < TOLERANCE:
        return f"1/{round(1 / factor)}"
    return f"{factor:.4g}"
