"""What a stub calls until it is written, and how the kit sees that a method still calls it."""

import dis
import inspect

from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.own_code.checks import unwrap
from taichi_tracer.system.parts import written

MARK = "not_written"  # the name of the function, as it stands in the code of a stub
OF_GRADERS = "NotImplementedError"  # nbgrader raises it where it has cut out a solution


@compile_time
def not_written(name: str) -> None:
    """Mark a method that a student has not written yet; kernels and Python may call it, and it does nothing.

    The checks, the grader and the window look for this call. They never run it to find out.

    Args:
        name: class and method, such as "Camera.generate_ray".
    """


def is_stub(method: object) -> bool:
    """Whether the code of a method calls ``not_written``, or raises a NotImplementedError.

    The method may be a Taichi function, a kernel or a static.
    """
    names = getattr(getattr(unwrap(method), "__code__", None), "co_names", ())
    return MARK in names or OF_GRADERS in names


def line_of_mark(method: object) -> int:
    """The line in which a method calls ``not_written``; 0 if it does not, or if its source is unknown."""
    try:
        lines, first = inspect.getsourcelines(unwrap(method))
    except OSError:
        return 0
    return next((first + i for i, line in enumerate(lines) if MARK in line or OF_GRADERS in line), 0)


def is_placeholder(cls: type, name: str) -> bool:
    """Whether a method is still that of the base code: it reads none of its arguments, or it calls one that does so."""
    methods = {word: unwrap(written(cls, word)) for word in dir(cls)}
    called = set(methods[name].__code__.co_names) & set(methods) - {name}
    return any(reads_nothing(methods[word]) for word in (name, *called) if hasattr(methods[word], "__code__"))


def reads_nothing(function: object) -> bool:
    """Whether a function never uses its arguments, as ``pass`` and ``return tm.vec3(0)``."""
    code = function.__code__  # type: ignore[attr-defined]
    arguments = set(code.co_varnames[: code.co_argcount])
    used = (one.argval for one in dis.get_instructions(code) if one.opname.startswith("LOAD_"))
    return bool(arguments) and not any(
        arguments & set(value if isinstance(value, tuple) else (value,)) for value in used
    )
