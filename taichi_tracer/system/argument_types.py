"""What the words of an option may be: numbers, sizes and lists of names, as argparse calls them.

Nothing here imports Taichi, so that ``--help`` and ``--version`` answer at once.
"""

import argparse
import math
import re
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

MOST_PIXELS = 8192**2  # their fields take 3 GB
Number = TypeVar("Number", int, float)


class OneOfOptions(argparse.Action):
    """Keeps the value of an option that has two names; the two names with two values are an error."""

    def __call__(self, parser, namespace, value, option=None) -> None:
        """Keep the value, and by which name it came."""
        former, by = getattr(namespace, self.dest), getattr(namespace, f"{self.dest}_option", option)
        if by != option and former != value:
            advice = "give one of them, or several names with commas"
            parser.error(f"{by} {former} and {option} {value} are two names of one option: {advice}")
        setattr(namespace, self.dest, value)
        setattr(namespace, f"{self.dest}_option", option)


def number(text: str) -> float:
    """A finite number, for argparse."""
    return checked(text, float, math.isfinite, "a finite number")


def positive(text: str) -> float:
    """A number more than 0, for argparse."""
    return checked(text, float, lambda value: 0 < value < float("inf"), "a number more than 0")


def percentage(text: str) -> float:
    """A number more than 0, with % or without, for argparse."""
    return positive(text.strip().removesuffix("%").rstrip())


def degrees(text: str) -> float:
    """An angle from 0 to 180 degrees, for argparse."""
    what = "an angle from 0 to 180 degrees (if it is the scene, put it before this option)"
    return checked(text, float, lambda value: 0 <= value <= 180, what)


def at_least_one(text: str) -> int:
    """A whole number of at least 1, for argparse."""
    return checked(text, int, lambda value: value >= 1, "a whole number of at least 1")


def whole(text: str) -> int:
    """A whole number of at least 0, for argparse."""
    return checked(text, int, lambda value: value >= 0, "a whole number of at least 0")


def checked(text: str, read: Callable[[str], Number], is_legal: Callable[[Number], bool], what: str) -> Number:
    """The value of a word; an error for argparse if it is not what it must be."""
    with suppress(ValueError):
        if is_legal(value := read(text)):
            return value
    raise argparse.ArgumentTypeError(f"{text.strip()!r} is not {what}")


def bounces(text: str) -> tuple[tuple[int, int | None], ...]:
    """(first, last) of each member of a list with commas such as "0,1,2-4,5+", for argparse; "5+" is (5, None)."""
    found = []
    for word in text.split(","):
        match = re.fullmatch(r"(\d+)(?:-(\d+)|(\+))?", word.strip(), re.ASCII)
        first, last, rest = match.groups() if match else (None, None, None)
        if first is None or (last is not None and int(last) < int(first)):
            raise argparse.ArgumentTypeError(
                f"{text.strip()!r} is not a list of numbers of bounces, such as 0,1,2-4,5+, where 2-4 is all the light "
                "after two to four bounces, and 5+ after five or more"
            )
        found.append((int(first), None if rest else int(first if last is None else last)))
    return tuple(found)


def wholes(text: str) -> tuple[int, ...]:
    """The whole numbers of at least 0 in a list with commas, for argparse."""
    return tuple(whole(part) for part in text.split(","))


def names(text: str) -> tuple[str, ...]:
    """The names in a list with commas, for argparse."""
    return tuple(text.split(","))


def size(text: str) -> tuple[int, int]:
    """Width and height from "640x480", for argparse; "512" is a square."""
    match = re.fullmatch(r"(\d+)(?:\s*[x×]\s*(\d+))?", text.strip().lower(), re.ASCII)
    width, height = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
    if width < 1 or height < 1:
        raise argparse.ArgumentTypeError(
            f"{text.strip()!r} is not WIDTHxHEIGHT, two whole numbers of at least 1, such as 640x480"
        )
    if width * height > MOST_PIXELS:
        raise argparse.ArgumentTypeError(f"{text.strip()!r} has more than {MOST_PIXELS:,} pixels")
    return width, height
