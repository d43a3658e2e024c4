"""Checkpoints: the content of a film and a description of it, so that a rendering can continue later or elsewhere.

A file is an archive of arrays in the format of numpy (.npz), which notices by itself whether it is damaged. An older
file is replaced only when the new file is complete.
"""

import io
import json
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import read_bytes, replace_file
from taichi_tracer.system.errors import InputError

EXTENSION = ".checkpoint"
FACTS = "facts as JSON"  # the name of their array


def write_checkpoint(path: str | Path, facts: dict, arrays: dict[str, np.ndarray]) -> None:
    """Write a checkpoint, either completely or not at all.

    Args:
        facts: which samples these are, and the picture to which they belong; values that JSON can represent.
        arrays: name → array.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **{FACTS: np.array(json.dumps(facts))}, **arrays)
    replace_file(path, buffer.getvalue())


def read_checkpoint(path: str | Path) -> tuple[dict, dict[str, np.ndarray]]:
    """The facts and the arrays of a checkpoint.

    Raises:
        InputError: the file is not a checkpoint, is truncated, or has been changed.
    """
    raw = read_bytes(path)
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
            return json.loads(str(arrays.pop(FACTS))), arrays
    except Exception:  # damaged archives raise all kinds of errors
        raise InputError(f"{path}: this is no checkpoint of taichi_tracer, or it is damaged") from None


def check_same(path: str | Path, facts: dict, other: str, theirs: dict) -> None:
    """Raise an InputError if a checkpoint and another one, or a picture, do not belong together.

    Args:
        path, facts: the checkpoint.
        other, theirs: the name of the other checkpoint or picture in messages, and its facts.
    """
    for name in [*theirs, *(name for name in facts if name not in theirs)]:
        mine, wanted = facts.get(name), theirs.get(name)
        if mine != wanted:
            detail = "" if name in ("scene", "camera") else f": {mine} there, {wanted} here"
            raise InputError(f"{path}: its samples do not belong to {other}: another {name}{detail}")


def show_ranges(ranges: list[list[int]]) -> str:
    """The text for ranges of sample indices: "0 to 63"."""
    return ", ".join(f"{first} to {end - 1}" for first, end in ranges)


def joined(first: list[list[int]], second: list[list[int]]) -> list[list[int]]:
    """All ranges of both lists in ascending order; ranges that touch are joined.

    Raises:
        InputError: a sample is in both lists.
    """
    ranges: list[list[int]] = []
    for start, end in sorted([*first, *second]):
        if ranges and start < ranges[-1][1]:
            raise InputError(f"samples {start} to {min(end, ranges[-1][1]) - 1} are in both: each may count once")
        if ranges and start == ranges[-1][1]:
            ranges[-1][1] = end
        else:
            ranges.append([start, end])
    return ranges
