"""Marks: the points of each part, and what was found, as JSON."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from taichi_tracer.teaching.base import DIGITS, RIGHT, PartResult

# What a mark says of each part.
OF_A_PART = ("name", "topic", "points", "share", "status", "message", "first_wrong", "findings", "seconds")


@dataclass(frozen=True)
class Mark:
    """The mark of one submission.

    Attributes:
        key, student: see ``submissions.Submission``. refused: why it was not unpacked; "" if it was.
        notes: what the report says about the files.
        printed: what it printed, cut.
    """

    key: str
    student: str
    parts: tuple[PartResult, ...]
    refused: str = ""
    notes: tuple[str, ...] = ()
    printed: str = ""

    @property
    def points(self) -> float:
        """The points that can be had."""
        return round(sum(part.points for part in self.parts), DIGITS)

    @property
    def score(self) -> float:
        """The points of all parts."""
        return round(sum(part.earned for part in self.parts), DIGITS)

    @property
    def seconds(self) -> float:
        """How long all parts took."""
        return sum(part.seconds for part in self.parts)

    @property
    def right(self) -> int:
        """How many parts are right."""
        return sum(part.status == RIGHT for part in self.parts)

    def facts(self) -> dict:
        """The mark for JSON, with its sums."""
        parts = [{name: getattr(part, name) for name in (*OF_A_PART, "earned")} for part in self.parts]
        return to_json({**vars(self), "parts": parts, "score": self.score, "earned": self.score, "points": self.points})


def most_points(marks: Sequence[Mark]) -> float:
    """The points that can be had in a class, with the optional parts that somebody handed in."""
    return max(mark.points for mark in marks)


def to_json(value: Any) -> Any:
    """A value for JSON: numbers that JSON does not have, such as NaN, become words."""
    if isinstance(value, Mapping):
        return {str(name): to_json(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
