"""What functions have of their modules that Python runs while a kernel is read: Taichi does not ask for it.

Such are the functions with ``in_kernels``, the getters of properties, and the functions that these call. Each name that
they use may be a constant of the kernel.
"""

import inspect
import sys
import types
from collections.abc import Iterator
from typing import Any

from taichi.lang.matrix import MatrixType
from taichi.lang.struct import StructType

from taichi_tracer.system.seams import runs_in_kernels
from taichi_tracer.system.taichi_17.questions import FOREVER, NUMBERS, Notes, One, Question

OWN = "taichi_tracer"
HOMES = {OWN, "taichi", "numpy", *sys.stdlib_module_names}  # packages whose objects nobody exchanges by calls


def note(notes: Notes) -> None:
    """Add the questions for these names to those that the reading of a kernel asked."""
    for question, wanted in questions_of(notes):
        notes.outside.setdefault((id(question.of), question.name), (question, wanted))


def questions_of(notes: Notes) -> Iterator[tuple[Question, Any]]:
    """The questions for the names, and the answers."""
    seen: set[Any] = set()
    waiting = [*functions_in((notes.first, notes.asked, [wanted for _, wanted in notes.outside.values()]))]
    for number, name in notes.asked:
        kept = inspect.getattr_static(type(notes.objects[number]), name, None)
        getter = kept.fget if isinstance(kept, property) else getattr(kept, "func", None)
        waiting += [getter] if isinstance(getter, types.FunctionType) else []
    while waiting:
        function = waiting.pop()
        if function in seen or is_of_others(function.__module__) or runs_in_kernels(function):
            continue
        seen.add(function)
        names, words = function.__globals__, set(names_in(function.__code__))
        for name in sorted(words & names.keys()):
            there = names[name]
            values = [(Question("name", names, name), there)]
            if has_attributes(there, is_home(function.__module__)):
                values += [
                    (Question("attribute", there, one), vars(there)[one]) for one in sorted(words & vars(there).keys())
                ]
            for question, value in values:
                waiting += [value] if isinstance(value, types.FunctionType) else []
                wanted = constant(value) if is_home(function.__module__) else notes.described(value)
                if wanted is not None:
                    yield question, wanted


def is_home(module: str) -> bool:
    """Whether a module belongs to one of ``HOMES``."""
    return module.partition(".")[0] in HOMES


def has_attributes(value: Any, is_own: bool) -> bool:
    """Whether the attributes of a value may be constants: those of modules, and in a student's code of all objects.

    Args:
        is_own: whether the package's own code uses the value; what its objects have changes by calls.
    """
    if isinstance(value, types.ModuleType):
        return not is_of_others(value.__name__)
    home = value.__module__ if isinstance(value, type) else type(value).__module__
    return not is_own and hasattr(value, "__dict__") and not is_of_others(home)


def is_of_others(module: str | None) -> bool:
    """Whether a module is part of Python, of numpy or of Taichi."""
    return is_home(module or "builtins") and not (module or "").startswith(OWN)


def functions_in(wanted: Any) -> Iterator[types.FunctionType]:
    """The functions among answers."""
    if isinstance(wanted, One):
        if isinstance(function := wanted.value(), types.FunctionType):
            yield function
    elif isinstance(wanted, (tuple, list, dict)):
        for one in wanted.values() if isinstance(wanted, dict) else wanted:
            yield from functions_in(one)


def names_in(code: types.CodeType) -> Iterator[str]:
    """The names that a function and those in it use besides their own."""
    yield from code.co_names
    for one in code.co_consts:
        if isinstance(one, types.CodeType):
            yield from names_in(one)


def constant(value: Any) -> Any:
    """What another value must be to stand for this one, if nobody changes it by calls; None if somebody may."""
    if isinstance(value, NUMBERS):
        return type(value), value
    if type(value) is tuple:
        elements = [constant(one) for one in value]
        return None if None in elements else (tuple, elements)
    home = value.__module__ if isinstance(value, type) else type(value).__module__
    return One(value) if isinstance(value, (*FOREVER, MatrixType, StructType)) or not is_home(home) else None
