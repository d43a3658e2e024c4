"""The elements of an XML document and of the documents that it includes, one after the other, with file and line.

The parser is Python's expat. A document type is refused before it is read. Therefore there are no entities, which could
expand without limit or name other files and network addresses. An ``Element`` knows the
values of its attributes: numbers, colours, names; and it notes the attributes that are unknown.
"""

import difflib
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from taichi_tracer.files.disk import read_bytes
from taichi_tracer.files.readers.text import number
from taichi_tracer.system.errors import InputError, MissingFileError, one_of

FLAGS = {"yes": True, "true": True, "on": True, "1": True, "no": False, "false": False, "off": False, "0": False}
LONGEST_SHOWN = 40  # characters of a wrong value that a message shows
LARGEST_WHOLE = 1 << 30  # the largest whole number that an attribute may have; it fits into 32 bits


class Element:
    """One element: its tag, its attributes, and its place.

    Each method takes the name of an attribute that the element may have. Attributes that no method asked for are
    reported as unknown.

    Args:
        tag: the name of the element.
        attributes: name → text.
        where: file and line, for messages.
        note: takes a line for the user.
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
            hint = f" ({near[0]!r} is not known)" if near else ""
            raise self.error(f"needs the attribute {names[0]}{hint}")
        return name

    def numbers(self, *names: str, count: int | tuple[int, ...] = 3, default=None) -> np.ndarray | None:
        """``count`` finite float64 numbers; ``default`` if the attribute is missing."""
        name = self.find(*names)
        if name is None:
            return default
        counts = (count,) if isinstance(count, int) else count
        words = self.attributes[name].split(maxsplit=max(counts))
        allowed = " or ".join(str(c) for c in counts)
        expected = f"{allowed} finite numbers" if counts != (1,) else "a finite number"
        try:
            values = np.array([number(word, "") for word in words])
        except InputError:
            values = np.array(np.nan)
        if len(words) not in counts or not np.isfinite(values).all():
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
        if not (text.isascii() and text.isdigit() and len(text) <= len(str(most)) and least <= int(text) <= most):
            raise self.wrong(name, f"a whole number from {least} to {most}")
        return int(text)

    def choice(self, *names: str, of: dict[str, Any], default: Any = None) -> Any:
        """The meaning of a word or a name; ``of`` maps each allowed word, with its synonyms, to a meaning."""
        name = self.need(*names) if default is None else self.find(*names)
        if name is None:
            return default
        text = self.attributes[name].strip()
        word = text if text in of else text.lower()
        if word not in of:
            raise InputError(f"{self.where}: {one_of(f'<{self.tag}> {name}', text[:LONGEST_SHOWN], of)}")
        return of[word]

    def text(self, *names: str) -> str | None:
        """A text that is not empty; None if the attribute is missing."""
        name = self.find(*names)
        if name is None:
            return None
        if not self.attributes[name].strip() or "\0" in self.attributes[name]:
            raise self.wrong(name, "a name")
        return self.attributes[name].strip()

    def path(self, name: str) -> Path:
        """The file that an attribute names, relative to the folder of the document."""
        text, document = self.text(self.need(name)), Path(self.where.rsplit(":", 1)[0])
        path = document.parent / Path(text.replace("\\", "/")).expanduser()
        if not path.is_file():
            raise MissingFileError(f"{self.where}: <{self.tag}> {name}: no such file {text!r} beside {document.name}")
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
        what = "whole numbers" if dtype is np.int64 else "finite numbers"
        try:
            values = np.array(self.attributes[name].split(), dtype)
        except (ValueError, OverflowError) as error:
            raise self.error(f"{name} must be {what}: {error}") from None
        if len(values) == 0 or len(values) % columns != 0 or not np.isfinite(values).all():
            raise self.error(f"{name} must be {what} in groups of {columns}; it has {len(values)}")
        return values.reshape(-1, columns)

    def note_unknown(self) -> None:
        """Add a note for every unknown attribute, with the most similar known name."""
        for name in self.attributes:
            if name not in self.known:
                self.note(f"{self.where}: {one_of(f'attribute of <{self.tag}>', name[:LONGEST_SHOWN], self.known)}")


def read_elements(
    path: Path, handle: Callable[[Element], None], note: Callable[[str], None], where: str = "", within: tuple = ()
) -> None:
    """Call ``handle`` for every element except the roots. An ``include`` is replaced by the elements of its file.

    Args:
        note: takes a line for the user.
        where: the line that includes the document. within: the files that are being read; each one includes the next.

    Raises:
        InputError: the file is not XML; the message has file and line.
    """
    resolved = path.resolve()
    if resolved in within:
        chain = " -> ".join(p.name for p in [*within[within.index(resolved) :], resolved])
        raise InputError(f"{where}: {path.name} includes itself: {chain}")
    content, parser = read_bytes(path), expat.ParserCreate()

    def here() -> str:
        """The file and the line that the parser has reached."""
        return f"{path}:{parser.CurrentLineNumber}"

    def root(*_) -> None:
        """The first element, which may have any name."""
        parser.StartElementHandler = start

    def start(tag: str, attributes: dict[str, str]) -> None:
        """Handle an element within the root."""
        element = Element(tag, attributes, here(), note)
        if tag == "include":
            read_elements(element.path("filename"), handle, note, element.where, (*within, resolved))
        else:
            handle(element)
        element.note_unknown()

    def refuse(*_) -> None:
        """Refuse a document type before it is read."""
        raise InputError(f"{here()}: a document type (<!DOCTYPE>) and entities are not read: remove them")

    parser.StartElementHandler = root
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(content, True)
    except InputError:
        raise
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise InputError(f"{here()}: this is not well-formed XML: {error}") from None
