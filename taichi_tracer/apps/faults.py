"""Errors in the code of somebody's own parts, told in one line with the file and the line of it.

A file of ``--parts`` can be read without an error and still hold one: a kernel is compiled when a picture needs it, and
a method is called when a scene is made. Taichi tells where by a text of many lines, in which most places are ours.
"""

import re
import traceback
from collections.abc import Sequence
from pathlib import Path

PLACE = re.compile(r'^File "(.+)", line (\d+), in (.+):$', re.MULTILINE)  # as Taichi tells places, the innermost last


def text_of_fault(error: Exception, parts: Sequence[str]) -> str | None:
    """The line for an error that arose in the code of one of the files; None where it did not.

    Of an error in a kernel that names none of the files, the last line is told: a part that lacks a method is missed by
    the code that calls it.
    """
    named = {str(Path(path).expanduser().resolve()): path for path in parts}
    compiles = type(error).__module__ == "taichi.lang.exception"
    if compiles:
        places = [(file, int(line)) for file, line, _ in PLACE.findall(str(error))]
        what = str(error).strip().splitlines()[-1]
    else:
        places = [(frame.filename, frame.lineno) for frame in traceback.extract_tb(error.__traceback__)]
        what = f"{type(error).__name__}: {error}"
    own = [f"{named[file]}:{line}: {what}" for file, line in places if file in named]
    if own:
        return own[-1]
    return what if parts and (compiles or isinstance(error, NotImplementedError)) else None
