"""The values of the attributes of an element: numbers, colours, names; and notes about unknown attributes."""

import difflib
import math
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np

from taichi_tracer.files.text import IS_SPACE, all_numbers, number
from taichi_tracer.system.errors import InputError, MissingFileError, one_of

YES, NO = ("yes", "true", "on", "1"), ("no", "false", "off", "0")
LONGEST_SHOWN = 40  # characters of a wrong value that a message shows
LONGEST_PATH_SHOWN = 200  # characters of the path of a missing file that a message shows
LARGEST_WHOLE = 1 << 30  # the largest whole number that an attribute may have; it fits into 32 bits
MOST_DIGITS = 11  # of a whole number: more digits exceed every limit, and would take Python long to convert


class Element:
    """One element: its tag, its attributes, and its place.

    Each method takes the name of an attribute that the element may have. Attributes that no method asked for are
    reported as unknown.

    Args:
        tag: the name of the element.
        attributes: name → text.
        where: file and line, for messages.
        note: a function that takes a line for the user, or a function that makes this line.
    """

    def __init__(self, tag: str, attributes: dict[str, str], where: str, note: Callable) -> None:
        self.tag, self.attributes, self.where, self.note = tag, attributes, where, note
        self.known: dict[str, None] = {}

    def error(self, message: str) -> InputError:
        """An InputError with file, line and tag."""
        return InputError(f"{self.where}: <{self.tag}> {message}")

    def wrong(self, name: str, expected: str) -> InputError:
        """The InputError for an attribute with a wrong value."""
        text = self.attributes[name]
        shown = text if len(text) <= LONGEST_SHOWN else text[:LONGEST_SHOWN] + "…"
        return self.error(f"{name} must be {expected}, not {shown!r}")

    def find(self, *names: str) -> str | None:
        """The name of an attribute that the element uses, out of several synonyms; None if it uses none."""
        self.known |= dict.fromkeys(names)
        given = [name for name in names if name in self.attributes]
        if len(given) > 1:
            raise self.error(f"{given[0]} and {given[1]} mean the same: give one of them")
        return given[0] if given else None

    def need(self, *names: str) -> str:
        """The same as ``find``, but a missing attribute is an error."""
        name = self.find(*names)
        if name is None:
            near = difflib.get_close_matches(names[0], self.attributes, n=1)
            told = f" ({near[0]!r} is not known)" if near else ""
            raise self.error(f"needs the attribute {names[0]}{told}")
        return name

    def numbers(self, *names: str, count: int | tuple[int, ...] = 3, default=None) -> np.ndarray | None:
        """``count`` finite float64 numbers; ``default`` if the attribute is missing."""
        name = self.find(*names)
        if name is None:
            return default
        counts = (count,) if isinstance(count, int) else count
        words = self.attributes[name].split(maxsplit=max(counts))
        told = " or ".join(str(c) for c in counts)
        expected = f"{told} finite numbers" if counts != (1,) else "a finite number"
        if len(words) not in counts:
            raise self.wrong(name, expected)
        try:
            values = np.array([number(word, "") for word in words])
        except InputError:
            raise self.wrong(name, expected) from None
        if not np.isfinite(values).all():
            raise self.wrong(name, expected)
        return values

    def number(self, *names: str, default: float | None = None, above: float = -math.inf) -> float | None:
        """One finite number that is greater than ``above``."""
        values = self.numbers(*names, count=1)
        if values is None:
            return default
        if not values[0] > above:
            raise self.wrong(self.find(*names), f"a number above {above:g}")
        return float(values[0])

    def whole(self, *names: str, default: int | None = None, least: int = 1, most: int = LARGEST_WHOLE) -> int | None:
        """One whole number from ``least`` to ``most``."""
        name = self.find(*names)
        if name is None:
            return default
        text = self.attributes[name].strip()
        if not (text.isascii() and text.isdigit() and len(text) <= MOST_DIGITS and least <= int(text) <= most):
            raise self.wrong(name, f"a whole number from {least} to {most}")
        return int(text)

    def flag(self, *names: str, default: bool) -> bool:
        """True for yes, true, on, 1; False for no, false, off, 0."""
        name = self.find(*names)
        if name is None:
            return default
        word = self.attributes[name].strip().lower()
        if word not in YES + NO:
            raise self.wrong(name, f"one of {', '.join(YES + NO)}")
        return word in YES

    def choice(self, *names: str, of: dict[str, str], default: str | None = None) -> str:
        """The meaning of a word; ``of`` maps each allowed word, with its synonyms, to a meaning."""
        name = self.need(*names) if default is None else self.find(*names)
        if name is None:
            return default
        word = self.attributes[name].strip()
        if word not in of:
            raise InputError(f"{self.where}: {one_of(f'<{self.tag}> {name}', word[:LONGEST_SHOWN], of)}")
        return of[word]

    def text(self, *names: str) -> str | None:
        """A text that is not empty; None if the attribute is missing."""
        name = self.find(*names)
        if name is None:
            return None
        if not self.attributes[name].strip() or "\0" in self.attributes[name]:
            raise self.wrong(name, "a name")
        return self.attributes[name].strip()

    def path(self, name: str, beside: Path) -> Path:
        """The file that an attribute names, relative to the folder of the document."""
        text = self.text(self.need(name))
        path = beside.parent / Path(text.replace("\\", "/")).expanduser()
        try:
            exists = path.exists()
        except OSError:
            exists = False
        if not exists:
            shown = text if len(text) <= LONGEST_PATH_SHOWN else text[:LONGEST_PATH_SHOWN] + "…"
            raise MissingFileError(f"{self.where}: <{self.tag}> {name}: no such file {shown!r} beside {beside.name}")
        return path

    def colors(self, *names: str) -> dict[str, tuple[float, float, float]]:
        """Name → linear RGB in [0, 1], for each of the attributes that the element has.

        If any component is above 1, all colours of the element are in 0…255 (C-13).
        """
        found = {name: values for name in names if (values := self.numbers(name, count=(1, 3))) is not None}
        is_bytes = any((values > 1).any() for values in found.values())
        for name, values in found.items():
            if (values < 0).any() or (values > 255).any():
                raise self.wrong(name, "a colour, each component in 0…1 or in 0…255")
        scale = 255.0 if is_bytes else 1.0
        return {name: tuple(float(v) for v in np.resize(values / scale, 3)) for name, values in found.items()}

    def table(self, name: str, columns: int, dtype: type = np.float64) -> np.ndarray | None:
        """(n, ``columns``) numbers from a long list; None if the attribute is missing."""
        if self.find(name) is None:
            return None
        text = self.attributes[name].encode("utf-8", "replace")
        what = "whole numbers" if dtype is np.int64 else "finite numbers"
        values = all_numbers(text, dtype) if text.strip() else np.zeros(0, dtype)
        is_space = IS_SPACE[np.frombuffer(b" " + text, np.uint8)]
        words = int(np.count_nonzero(is_space[:-1] & ~is_space[1:]))
        if values is None or len(values) != words or not np.isfinite(values).all():
            at, word = next(((i, w) for i, w in enumerate(text.split()) if not _is_number(w, dtype)), (0, b""))
            raise self.error(f"{name} must be {what}: number {at} is {word[:LONGEST_SHOWN].decode()!r}")
        if len(values) == 0 or len(values) % columns != 0:
            raise self.error(f"{name} must be {what} in groups of {columns}, not {len(values)} of them")
        return values.reshape(-1, columns)

    def note_unknown(self) -> None:
        """Add a note for every unknown attribute, with the most similar known name."""
        for name in self.attributes:
            if name not in self.known:
                self.note(partial(self._unknown, name))

    def _unknown(self, name: str) -> str:
        near = nearest(name, self.known)
        return f"{self.where}: <{self.tag}> has no attribute {name[:LONGEST_SHOWN]!r}{near}"


def nearest(name: str, known: Iterable[str]) -> str:
    """The end of a note about an unknown name: the most similar known name, or all known names."""
    known = list(known)
    near = difflib.get_close_matches(name[:LONGEST_SHOWN], known, n=1)
    if near:
        return f": did you mean {near[0]!r}?"
    return f" (known are {', '.join(known)})" if known else ""


def _is_number(word: bytes, dtype: type) -> bool:
    try:
        value = dtype(word) if dtype is np.float64 else np.int64(int(word))
    except (ValueError, OverflowError):
        return False
    return b"_" not in word and bool(np.isfinite(value))
