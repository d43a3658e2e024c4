"""A class compared with the package's class from which it derives: methods that lack, that are misspelt, or that cannot
be called as the package calls them.
"""

import difflib
import functools
import inspect
import linecache
import warnings
from collections.abc import Callable
from typing import Any

from taichi_tracer.system.own_code import rules
from taichi_tracer.system.own_code.kinds import expected
from taichi_tracer.system.own_code.source import (
    fault,
    fault_at,
    gives_nothing,
    is_own,
    parameters,
    place,
    unwrap,
    what_it_says,
)

DRAWN = {"xi", "rng", "jitter", "within"}  # arguments that a method may leave out: it draws its numbers itself
LIKE = 0.75  # how similar a misspelt name is to the right one, as ``difflib`` measures it


def check_class(cls: type, required: tuple[str, ...], file: str = "") -> None:
    """Raise an OwnCodeError if a class lacks a method that it must define.

    Args:
        required: the names of these methods. file: where the class is written, if that is known.
    """
    if is_packages(cls):
        return
    for name in required:
        found = inspect.getattr_static(cls, name)
        function = getattr(found, "written", found)
        if not is_own(function) and is_left_open(function):
            own = own_names(cls)
            near = difflib.get_close_matches(name, own, n=1, cutoff=0.6)
            guess = f": is {near[0]!r} misspelt?" if near else "."
            misspelt = vars_of(cls)[near[0]] if near else None
            arguments = ", ".join(["self", *(p.name for p in parameters(function))])
            text = f"{cls.__name__} lacks {name}({arguments}){guess} It gives: {what_it_says(function)}"
            raise fault(misspelt, text) if misspelt is not None else fault_at(*place_of(cls, file), text)


@functools.cache
def note_misspelt(cls: type, known: tuple[str, ...]) -> None:
    """Warn, once, of methods that nobody calls, and whose names are nearly those of the package's methods.

    Args:
        known: the names of the package's methods that a class may replace.
    """
    own = vars_of(cls)
    called = {name for function in own.values() for name in unwrap(function).__code__.co_names}
    for name in {*own_names(cls)} - called - {*known}:
        near = difflib.get_close_matches(name, {*known} - {*own}, n=1, cutoff=LIKE)
        if near:
            text = f"{place(own[name])}: nothing calls {cls.__name__}.{name}: did you mean {near[0]!r}?"
            warnings.warn(text, stacklevel=2)


def is_packages(cls: type) -> bool:
    """Whether a class and all its methods stand in the package."""
    return all(base.__module__.split(".")[0] in ("taichi_tracer", "builtins") for base in cls.__mro__)


def vars_of(cls: type) -> dict[str, Any]:
    """The methods that somebody has written in a class and in its bases: name → function."""
    found: dict[str, Any] = {}
    for base in reversed(cls.__mro__):
        found |= {n: v for n, v in vars(base).items() if hasattr(unwrap(v), "__code__") and is_own(v)}
    return found


def own_names(cls: type) -> list[str]:
    """Names of methods that somebody has added, and that the package's classes do not have."""
    packages = [base for base in cls.__mro__ if base.__module__.split(".")[0] == "taichi_tracer"]
    return [n for n in vars_of(cls) if not n.startswith("_") and not any(n in vars(base) for base in packages)]


def place_of(cls: type, file: str = "") -> tuple[str, int]:
    """The file and the line of a class."""
    own = [unwrap(function) for function in vars_of(cls).values()]
    file = own[0].__code__.co_filename if own else file
    text = "".join(linecache.getlines(file)).partition(f"class {cls.__name__}")[0]
    return file or cls.__module__, text.count("\n") + 1


@functools.cache
def is_left_open(function: Callable) -> bool:
    """Whether the package's method only says what a subclass must write."""
    names = unwrap(function).__code__.co_names
    return "static_assert" in names or "NotImplementedError" in names


@functools.cache
def check_method(owner: type, name: str, function: Callable, shipped: Callable, gives: str) -> None:
    """Raise an OwnCodeError if what somebody has written cannot take the place of a method of the package.

    Args:
        owner: the class for which it was written. function: what was written, as the class holds it.
        shipped: the package's method. gives: the kind of what it returns, see ``kinds``; "" if any is right.
    """
    if not is_own(function):
        return
    what = unwrap(function).__qualname__.split("<locals>.")[-1]
    if gives and is_plain_python(function):
        raise fault(function, f"{what} runs in kernels: write @ti.func above it")
    is_kernel = hasattr(getattr(function, "__func__", function), "_is_wrapped_kernel")
    if hasattr(unwrap(shipped), "__code__") and not is_kernel:  # a kernel may write a field instead
        check_parameters(what, function, shipped)
        if not is_plain_python(function) and gives_nothing(function) and not gives_nothing(shipped):
            raise fault(function, f"{what} has no return with a value. It gives: {what_it_says(shipped)}")
    rules.check(function, owner)
    if gives:
        expected[unwrap(function)] = what, gives


def check_parameters(what: str, function: Callable, shipped: Callable) -> None:
    """Raise an OwnCodeError if the package cannot call a function as it calls its own."""
    given, wanted = parameters(function), parameters(shipped)
    if any(p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) for p in given):
        return
    rules.check_self(what, function, shipped)
    names, known = [p.name for p in given], [p.name for p in wanted]
    needed = [p for p in wanted if p.name not in DRAWN and p.default is p.empty]
    least = [p.name for p in given if p.default is p.empty]
    why = ""
    if len(least) > len(known):
        why = f"{', '.join(least[len(known) :])} comes from nowhere"
    elif len(names) < len(needed):
        why = f"it takes only {', '.join(names) or 'self'}"
    elif names != known and sorted(names) == sorted(known):
        why = f"its arguments stand in another order, {', '.join(names)}"
    if why:
        raise fault(function, f"{what} is called as {what}({', '.join(known)}), but {why}")


def is_plain_python(function: Any) -> bool:
    """Whether a function is neither one of Taichi nor one that may be called in kernels; a formula in a lambda may."""
    inner = getattr(function, "__func__", function)
    marks = "_is_taichi_function", "_is_wrapped_kernel", "is_for_python_too"
    is_marked = any(hasattr(inner, mark) for mark in marks)
    return inspect.isfunction(inner) and inner.__name__ != "<lambda>" and not is_marked
