"""Checkpoints: what a film holds, and of what, so that a rendering can go on later or elsewhere.

A file holds a line that says what it is, a line of JSON, and the arrays in numpy's own format; the JSON has the SHA-256
of the arrays. An older file is
replaced only when the new one is complete.
"""

import hashlib
import io
import json
from pathlib import Path

import numpy as np

from taichi_tracer.errors import InputError
from taichi_tracer.files.disk import read_bytes, replace_file

EXTENSION = ".checkpoint"
MAGIC = b"taichi_tracer checkpoint 1\n"
LONGEST_HEADER = 1 << 20  # bytes


def write_checkpoint(path: str | Path, facts: dict, arrays: dict[str, np.ndarray]) -> None:
    """Write a checkpoint, whole or not at all.

    Args:
        facts: what can be JSON: what the samples are of, and which.
        arrays: name → array.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    content = buffer.getvalue()
    header = json.dumps({"sha256": hashlib.sha256(content).hexdigest(), **facts}).encode() + b"\n"
    replace_file(path, MAGIC + header + content)


def read_checkpoint(path: str | Path) -> tuple[dict, dict[str, np.ndarray]]:
    """The facts and the arrays of a checkpoint.

    Raises:
        InputError: the file is no checkpoint, is cut short, or is not as it was written.
    """
    raw = read_bytes(path)
    if not raw.startswith(MAGIC):
        raise InputError(f"{path}: this is no checkpoint of taichi_tracer")
    end = raw.find(b"\n", len(MAGIC), len(MAGIC) + LONGEST_HEADER)
    try:
        facts = json.loads(raw[len(MAGIC) : end])
        expected = facts.pop("sha256")
    except (ValueError, KeyError, AttributeError, TypeError):
        raise InputError(f"{path}: the checkpoint is damaged: its header cannot be read") from None
    content = raw[end + 1 :]
    if hashlib.sha256(content).hexdigest() != expected:
        raise InputError(
            f"{path}: the checkpoint is cut short or damaged: its contents are not those that were written"
        )
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return facts, {name: archive[name] for name in archive.files}


def check_same(path: str | Path, facts: dict, other: str, theirs: dict) -> None:
    """Raise InputError where two checkpoints, or one and a picture, are not of the same.

    Args:
        path, facts: the one.
        other, theirs: what the other is called, and its facts.
    """
    for name in [*theirs, *(name for name in facts if name not in theirs)]:
        mine, wanted = facts.get(name), theirs.get(name)
        if mine != wanted:
            detail = "" if name in ("scene", "camera") else f": {mine} there, {wanted} here"
            raise InputError(f"{path}: its samples do not belong to {other}: another {name}{detail}")


def show_ranges(ranges: list[list[int]]) -> str:
    """Sample indices in words: "0 to 63"."""
    return ", ".join(f"{first} to {end - 1}" for first, end in ranges)


def joined(first: list[list[int]], second: list[list[int]]) -> list[list[int]]:
    """The ranges of both, in order, those that touch made one.

    Raises:
        InputError: a sample is in both.
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
