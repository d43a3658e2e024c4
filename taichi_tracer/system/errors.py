"""Errors that are the user's to mend: one line with the file, line, value and what would have worked."""

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """The input cannot be used as it is. The command line prints the message alone and exits with code 2."""


class MissingFileError(InputError, FileNotFoundError):
    """A file that was named does not exist or cannot be opened."""

    def __str__(self) -> str:
        return str(self.args[0])


class StaleSceneError(RuntimeError):
    """An object whose Taichi memory is gone, because Taichi was initialised again after it was made."""


def one_of(what: str, value: object, known: Iterable[str]) -> InputError:
    """The error for a name that is not among the known ones, with the nearest one where there is one."""
    known = list(known)
    near = difflib.get_close_matches(str(value), known, n=1)
    guess = f"did you mean {near[0]!r}? " if near else ""
    return InputError(f"unknown {what} {value!r}: {guess}known are {', '.join(known)}")
