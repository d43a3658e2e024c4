"""The parts of text files: encodings, line ends, continued lines, comments, and numbers."""

import codecs
import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import read_bytes
from taichi_tracer.system.errors import InputError

SPACES = b" \t\n\r\f\v"
IS_SPACE = np.isin(np.arange(256), list(SPACES))
NEWLINE, SLASH, BLANK = b"\n/ "
INDENT = re.compile(rb"[^\S\n]*")
COMMENT = re.compile(rb"#[^\n]*")
NOT_A_NUMBER = re.compile(rb"(?<=[ \t])[-+]?(?:nan\([^)\s]*\)|\d\.#(?:IND|[QS]NAN)\w*)(?=\s)", re.IGNORECASE)  # of MSVC
INFINITE = re.compile(rb"(?<=[ \t])([-+]?)\d\.#INF\w*(?=\s)", re.IGNORECASE)
COMMENT_OR_CONTINUATION = re.compile(rb"(#[^\n]*)|\\[ \t]*\n")


def read_text(path: Path) -> bytes:
    """The lines of a text file, each with ``\\n`` at its end.

    A line that ends in a backslash is joined to the next line. A carriage return marks the place, so that lines can
    still be counted. A backslash at the end of a comment, as in ``# made in C:\\scenes\\``, does not continue the line.
    What C writes for numbers that are none, ``-1.#IND`` or ``nan(ind)``, is ``nan``; ``1.#INF`` is ``inf``.
    """
    text = read_bytes(path)
    if b"\0" in text:
        raise InputError(f"{path}: this is a binary file, not text")
    text = text.removeprefix(codecs.BOM_UTF8)
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\\" in text:
        text = COMMENT_OR_CONTINUATION.sub(lambda match: match[1] or b" \r", text)
    text = text if text.endswith(b"\n") else text + b"\n"
    if b".#" in text or b"(" in text:
        text = INFINITE.sub(rb"\1inf", NOT_A_NUMBER.sub(b"nan", text))
    return text


def numbered_lines(text: bytes) -> Iterator[tuple[int, str]]:
    """(line number, line) for every line of ``read_text``. A joined line has the number of its first part."""
    line_number = 1
    for line in text.split(b"\n")[:-1]:
        yield line_number, decode(line)
        line_number += 1 + line.count(b"\r")


def decode(line: bytes) -> str:
    """The text of a line: UTF-8, or Latin-1 if it is not valid UTF-8."""
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def name_in(rest: str) -> str:
    """The name in the rest of a line. It may contain blanks, and a # as in ``Wall #2``; `` # `` begins a comment."""
    return re.split(r"(?:^|\s)#(?:\s|$)", rest, maxsplit=1)[0].strip()


def names_in(rest: str) -> list[str]:
    """What the name of a file in the rest of a line may be: all of it, without a comment, and each without quotes."""
    names = [rest.strip(), name_in(rest), re.split(r"\s#", rest, maxsplit=1)[0].strip()]
    names += [name[1:-1] for name in names if len(name) > 1 and name[0] == name[-1] and name[0] in "\"'"]
    return [name for name in dict.fromkeys(names) if name] or [""]


def number(word: str, where: str) -> float:
    """The float64 that is nearest to a decimal number; an InputError if ``word`` is none, or infinite."""
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in word or not word.isascii():  # Python would accept both
        raise InputError(f"{where}: {word!r} is not a number")
    return value


def all_numbers(text: bytes, dtype: type) -> np.ndarray | None:
    """All numbers of a text; None if it contains anything else. ``1.5.3`` gives two numbers: callers count them."""
    if b"(" in text:  # numpy's parser would read nan(1) as a number
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


@dataclass(frozen=True)
class KeywordLines:
    """All lines of one keyword, without the keyword.

    Attributes:
        text: the lines, each with ``\\n`` at its end.
        ids: (n,) the indices of the lines in the file, counted from 0; a joined line counts once.
        numbers: (n,) the line numbers for messages.
    """

    text: bytes
    ids: np.ndarray
    numbers: np.ndarray

    def __len__(self) -> int:
        return len(self.ids)

    def lines(self) -> list[str]:
        """The lines without their ends."""
        return [decode(line) for line in self.text.split(b"\n")[:-1]]


class Lines:
    """The lines of a text, which can be selected by their first word."""

    def __init__(self, text: bytes) -> None:
        self.text = bytearray(text)
        self.bytes = np.frombuffer(self.text, np.uint8)
        self.ends = np.flatnonzero(self.bytes == NEWLINE)
        self.starts = np.concatenate(([0], self.ends[:-1] + 1))
        first = self.bytes[self.starts]
        indented = np.flatnonzero(IS_SPACE[first] & (first != NEWLINE))
        self.starts[indented] = [INDENT.match(text, start).end() for start in self.starts[indented].tolist()]
        self.joints = np.flatnonzero(self.bytes == ord("\r")) if b"\r" in text else np.zeros(0, np.int64)

    def take(self, keyword: bytes, has_names: bool = False) -> KeywordLines:
        """The lines that begin with this word. Blanks replace the word, so that no later call finds these lines.

        Args:
            has_names: whether they end in a name, which may contain ``#``; the comments of others are left out.
        """
        ids = np.arange(len(self.starts))
        for k, letter in enumerate(keyword):
            ids = ids[self.bytes[self.starts[ids] + k] == letter]
        ids = ids[IS_SPACE[self.bytes[self.starts[ids] + len(keyword)]]]
        for k in range(len(keyword)):
            self.bytes[self.starts[ids] + k] = BLANK
        numbers = 1 + ids + np.searchsorted(self.joints, self.starts[ids])
        text = self._runs(ids)
        return KeywordLines(text if has_names or b"#" not in text else COMMENT.sub(b"", text), ids, numbers)

    def _runs(self, ids: np.ndarray) -> bytes:
        """The text of some lines. Neighbouring lines are copied together."""
        breaks = np.flatnonzero(np.diff(ids) != 1)
        firsts, lasts = ids[np.r_[0, breaks + 1]] if len(ids) else ids, ids[np.r_[breaks, -1]] if len(ids) else ids
        begin, end = self.starts[firsts].tolist(), (self.ends[lasts] + 1).tolist()
        view = memoryview(self.text)
        return b"".join([view[b:e] for b, e in zip(begin, end, strict=True)])
