"""Folders that were made for files to come: those that have stayed empty are removed after an error."""

import contextlib
from pathlib import Path

made: list[Path] = []  # the outer before the inner


def remove_empty() -> None:
    """Remove those in which nothing is."""
    while made:
        with contextlib.suppress(OSError):
            made.pop().rmdir()
