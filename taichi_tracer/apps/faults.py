"""Errors in the code of somebody's own parts, in one line with the file and the line of it.

A file of ``--parts`` can be read without an error and still hold one: a kernel is compiled when a picture needs it, and
a method is called when a scene is made.
"""

import traceback
from collections.abc import Sequence
from pathlib import Path

from taichi_tracer.system.own_code.checks import shown_place
from taichi_tracer.system.own_code.faults import fault_of

# What Python or Taichi says of code outside of kernels → what it means.
MEANINGS = {
    "truth value of an array": "a whole array comes here: use + - * / and powers, and no if",
    "cannot be called from Python-scope": "a function of Taichi runs in kernels only: numpy has it for Python",
}


def text_of_fault(error: Exception, parts: Sequence[str]) -> str | None:
    """The line for an error that arose in the code of one of the files; None where it did not.

    Of an error in a kernel that names none of the files, the last line counts: a part that lacks a method is missed by
    the code that calls it.
    """
    files = [str(Path(path).expanduser().resolve()) for path in parts]
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename in files]
    is_of_python = any(text in str(error) for text in MEANINGS)
    if type(error).__module__ == "taichi.lang.exception" and not (is_of_python and frames):
        fault = fault_of(error)
        last = str(error).strip().splitlines()[-1]
        return str(fault) if fault is not None else last if parts else None
    if frames:
        place = shown_place(frames[-1].filename, frames[-1].lineno or 0)
        meant = next((means for text, means in MEANINGS.items() if text in str(error)), None)
        return f"{place}: {meant or f'{type(error).__name__}: {error}'}"
    return str(error) if parts and isinstance(error, NotImplementedError) else None
