"""Assignments: what students get, how they check their work, and how teachers grade it.

A file has one step, such as the export of a folder or a check; ``grading`` has the steps of the teacher. Add an
assignment as a folder of ``assignments``, see docs/teaching.md.

``tt.teaching.check("a1", MyCamera)`` checks a class of a notebook, ``not_written`` marks a method that has no solution
yet, and with ``marked`` a picture is dark as long as it needs such methods.
"""

from collections.abc import Sequence
from typing import Any


def __getattr__(name: str) -> Any:
    """What needs Taichi, when it is first used: the processes of the grader import this package before Taichi."""
    if name not in ("not_written", "marked"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from taichi_tracer.teaching.handout import stubs

    return getattr(stubs, name)


def check(assignment: str, *classes: type, seed: int = 0, parts: Sequence[str] = ()) -> Any:
    """Check the classes that a student wrote in a notebook, such as ``check("a1", MyCamera)``.

    Args:
        assignment: the name of an assignment that comes with the package, or the path of a folder with one.
        classes: subclasses of the classes that the assignment asks for. Their names do not matter.
        seed: decides the inputs.
        parts: only parts whose name, method or class is one of these; by default, all parts of these classes.

    Returns:
        A report, which a notebook shows as a page, and ``print`` as text.
    """
    from taichi_tracer.teaching.checking import check_classes

    return check_classes(assignment, classes, seed, parts)
