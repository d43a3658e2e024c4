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
    put_away()
    unfinished.clear()
    folders.clear()


def put_away() -> list[str]:
    """Remove the folders in which nothing is. Returns them; ``put_back`` makes them again."""
    away = []
    for folder in reversed(folders):
        with contextlib.suppress(OSError):
            os.rmdir(folder)
            away.append(folder)
    return away


def put_back(away: list[str]) -> None:
    """Make again what ``put_away`` has removed."""
    for folder in reversed(away):
        os.makedirs(folder, exist_ok=True)
