"""Checkpoints: the content of a film and a description of it, so that a rendering can continue later or elsewhere.

A file contains a line that identifies the format, the SHA-256 hash of the rest, a line of JSON, and the arrays in the
format of numpy. An older file is replaced only when the new file is complete.
"""

import hashlib
import io
import json
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import read_bytes, replace_file
from taichi_tracer.system.errors import InputError

EXTENSION = ".checkpoint"
MAGIC = b"taichi_tracer checkpoint 1\n"
HASH_LENGTH = 64  # characters


def write_checkpoint(path: str | Path, facts: dict, arrays: dict[str, np.ndarray]) -> None:
    """Write a checkpoint, either completely or not at all.

    Args:
        facts: which samples these are, and the picture to which they belong; values that JSON can represent.
        arrays: name → array.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    content = json.dumps(facts).encode() + b"\n" + buffer.getvalue()
    replace_file(path, MAGIC + hashlib.sha256(content).hexdigest().encode() + b"\n" + content)


def read_checkpoint(path: str | Path) -> tuple[dict, dict[str, np.ndarray]]:
    """The facts and the arrays of a checkpoint.

    Raises:
        InputError: the file is not a checkpoint, is truncated, or has been changed.
    """
    raw = read_bytes(path)
    if not raw.startswith(MAGIC):
        raise InputError(f"{path}: this is no checkpoint of taichi_tracer")
    stored_hash, content = raw[len(MAGIC) :][:HASH_LENGTH], raw[len(MAGIC) + HASH_LENGTH + 1 :]
    if hashlib.sha256(content).hexdigest().encode() != stored_hash:
        raise InputError(f"{path}: the checkpoint is cut short or damaged: it does not hold what was written")
    facts, arrays = content.split(b"\n", 1)
    with np.load(io.BytesIO(arrays), allow_pickle=False) as archive:
        return json.loads(facts), {name: archive[name] for name in archive.files}


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
