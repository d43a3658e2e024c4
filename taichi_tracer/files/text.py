"""Text files as they come: encodings, line ends, continued lines, and numbers that may not be any."""

from collections.abc import Iterator
from pathlib import Path

from taichi_tracer.errors import InputError, MissingFileError


def read_bytes(path: Path) -> bytes:
    """The content of a file; an InputError names what is in the way."""
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise MissingFileError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


def read_text(path: Path) -> str:
    """The content of a text file with ``\\n`` at the line ends; UTF-8, or Latin-1 where it is not."""
    raw = read_bytes(path)
    if b"\0" in raw[:4096]:
        raise InputError(f"{path}: this is a binary file, not text")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text


def logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """(line number, line) with lines that end in a backslash joined to the next; the number is the first one's."""
    first, parts = 0, []
    for line_number, line in enumerate(text.split("\n"), 1):
        if not parts:
            first = line_number
        if line.endswith("\\"):
            parts.append(line[:-1])
            continue
        yield first, (" ".join((*parts, line)) if parts else line)
        parts = []
    if parts:
        yield first, " ".join(parts)


def number(word: str, where: str) -> float:
    """The float64 nearest to a decimal number."""
    try:
        if "_" in word:
            raise ValueError
        return float(word)
    except ValueError:
        raise InputError(f"{where}: {word!r} is not a number") from None
