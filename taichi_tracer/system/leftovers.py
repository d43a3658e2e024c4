"""What a program that is interrupted does not leave behind: files that are not complete, and folders without files."""

import contextlib
import os

unfinished: set[str] = set()  # files that are being written
folders: list[str] = []  # that were made for files to come, the outer before the inner


def remove() -> None:
    """Delete them; a folder in which there is something stays."""
    for path in list(unfinished):
        with contextlib.suppress(OSError):
            os.unlink(path)
    for folder in reversed(folders):
        with contextlib.suppress(OSError):
            os.rmdir(folder)
    unfinished.clear()
    folders.clear()
