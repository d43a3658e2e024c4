"""Errors that the user can correct: one line with the file, the line, the value, and what would have worked."""

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """The input cannot be used. The command line prints only the message and exits with code 2."""


class OwnCodeError(InputError):
    """What somebody has written outside of the package cannot run. The message begins with its file and its line.

    Args:
        text: the message without the place. file, line: the place.
    """

    def __init__(self, message: str, text: str = "", file: str = "", line: int = 0) -> None:
        super().__init__(message)
        self.text, self.file, self.line = text, file, line


class CannotCompileError(InputError):
    """The backend of a graphics card cannot compile a kernel. The argument says which backend, and why."""

    def __str__(self) -> str:
        return f"{self.args[0]}: use the CPU, by --arch cpu or tt.init('cpu')"


class MissingFileError(InputError, FileNotFoundError):
    """A named file does not exist or cannot be opened."""

    def __str__(self) -> str:
        return str(self.args[0])


class StaleSceneError(RuntimeError):
    """The memory of an object is gone, because Taichi was initialised again after the object was made."""


def one_of(what: str, value: object, known: Iterable[str]) -> InputError:
    """The error for an unknown name. It lists the known names and, if there is one, suggests a similar name."""
    known = list(known)
    near = difflib.get_close_matches(str(value), known, n=1)
    guess = f"did you mean {near[0]!r}? " if near else ""
    return InputError(f"unknown {what} {value!r}: {guess}known are {', '.join(known)}")


class IncompleteError(RuntimeError):
    """A rendering ended before it reached its target. What came until then is on the film."""
