"""Errors that the user can correct: one line with the file, the line, the value, and what would have worked.

And numbers as text, for tables and messages.
"""

import difflib
import unicodedata
from collections.abc import Iterable

UNSEEN = ("Cc", "Cf", "Cs")  # a terminal obeys it and does not show it: control, direction of writing, half a character


def printable(text: str, keeps: str = "\n\t") -> str:
    r"""The text with ``\x1b`` and the like for control characters: a name in a file must not give a terminal orders."""
    return "".join(
        c if c in keeps or unicodedata.category(c) not in UNSEEN else c.encode("unicode_escape").decode() for c in text
    )


class InputError(ValueError):
    """The input cannot be used. The command line prints only the message and exits with code 2."""

    def __str__(self) -> str:
        return printable(super().__str__())


class OwnCodeError(InputError):
    """What somebody has written outside of the package cannot run. The message begins with its file and its line.

    Args:
        text: the message without the place. file, line: the place.
    """

    def __init__(self, message: str, text: str = "", file: str = "", line: int = 0) -> None:
        super().__init__(message)
        self.text, self.file, self.line = text, file, line


class CannotCompileError(InputError):
    """The backend of a graphics card cannot compile or run a kernel. The argument says which backend, and why."""

    def __str__(self) -> str:
        return f"{self.args[0]}: use the CPU, by --arch cpu or tt.init('cpu')"


class MissingFileError(InputError, FileNotFoundError):
    """A named file does not exist or cannot be opened."""


class NotFiniteWarning(UserWarning):
    """Many samples are NaN or infinite. The command line reports them at the end of a picture."""


class StaleSceneError(RuntimeError):
    """The memory of an object is gone, because Taichi was initialised again after the object was made."""


def one_of(what: str, value: object, known: Iterable[str]) -> InputError:
    """The error for an unknown name. It lists the known names and, if there is one, suggests a similar name."""
    known = list(known)
    near = nearest(str(value), known) if value else ""
    guess = f"did you mean {near!r}? " if near else ""
    return InputError(f"unknown {what} {value!r}: {guess}known are {', '.join(known)}")


def nearest(name: str, known: Iterable[str]) -> str:
    """The name that is meant, of those that are known; "" if none is similar."""
    known = list(known)
    small = {one.lower(): one for one in known}
    begins = [one for one in known if one.startswith(name) or name.startswith(one)]
    near = [*difflib.get_close_matches(name, known, n=1), *begins]
    return small[name.lower()] if name.lower() in small else near[0] if near else ""


def check_names(what: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Raise the error for a name of an argument that there is not, as Python does, but with the most similar one.

    Raises:
        TypeError: "unknown option of load_scene_data 'enviroment': did you mean 'environment'? known are …".
    """
    for name in given:
        if name not in known:
            raise TypeError(str(one_of(what, name, known)))


class IncompleteError(RuntimeError):
    """A rendering ended before it reached its target. What came until then is on the film."""


# ── numbers as text ──


def digits(value: float, spec: str = "g") -> str:
    """``format(value, spec)``, where 0 has no sign: neither −0, nor a negative number that is rounded to 0."""
    text = format(value, spec)
    is_zero = "-" in text and value == value and not any(c in "123456789" for c in text) and abs(value) < 1
    return format(0.0, spec) if is_zero else text


def digits_of(values: Iterable[float], spec: str = "g") -> str:
    """Some numbers in brackets: "(x, y, z)"."""
    return "(" + ", ".join(digits(value, spec) for value in values) + ")"
