"""Errors in the code of somebody's own parts, told in one line with the file and the line of it.

A file of ``--parts`` can be read without an error and still hold one: a kernel is compiled when a picture needs it, and
a method is called when a scene is made.
"""

import traceback
from collections.abc import Sequence
from pathlib import Path

from taichi_tracer.system.own_code.faults import fault_of
from taichi_tracer.system.own_code.source import told_place


def text_of_fault(error: Exception, parts: Sequence[str]) -> str | None:
    """The line for an error that arose in the code of one of the files; None where it did not.

    Of an error in a kernel that names none of the files, the last line is told: a part that lacks a method is missed by
    the code that calls it.
    """
    files = [str(Path(path).expanduser().resolve()) for path in parts]
    if type(error).__module__ == "taichi.lang.exception":
        fault = fault_of(error)
        last = str(error).strip().splitlines()[-1]
        return str(fault) if fault is not None else last if parts else None
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename in files]
    if frames:
        if "truth value of an array" in str(error):
            error = ValueError("a whole array comes here: use + - * / and powers, and no if")
        return f"{told_place(frames[-1].filename, frames[-1].lineno or 0)}: {type(error).__name__}: {error}"
    return str(error) if parts and isinstance(error, NotImplementedError) else None
