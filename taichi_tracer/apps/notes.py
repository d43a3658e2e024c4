"""Lines for the user beside what a command prints, and constants of all commands. Nothing here imports Taichi."""

import sys

from taichi_tracer.system.errors import printable

USER_ERROR = 2  # exit code: the input cannot be used, or a file could not be written where it was wanted
PICTURE_FOLDER = "renders"  # where pictures go for which nobody names a place
noted: set[str] = set()  # the notes of the command that runs


def note(text: str) -> None:
    """Print a line on stderr, once: a scene that is read three times says the same three times."""
    text = printable(text)
    if text not in noted:
        noted.add(text)
        print(f"taichi-tracer: note: {text}", file=sys.stderr)


def let_every_character_print() -> None:
    """Where a terminal or a pipe lacks a character, as in ASCII, print its number instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
