"""What a student has written in place of the package's method: checked before a kernel is compiled of it.

Taichi ends the process where a function gives nothing and its caller needs a number.
"""

import ast
import functools
import inspect
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

from taichi_tracer.system.errors import InputError

PACKAGE = Path(__file__).parents[1]


@functools.cache
def check(owner: str, name: str, function: Callable, shipped: Callable) -> None:
    """Raise an InputError if a method returns nothing, and the package's method of this name returns something.

    Args:
        owner: the name of the class, for the message. function: what the student wrote. shipped: the package's.
    """
    if is_packages(function) or not gives_nothing(function) or gives_nothing(shipped):
        return
    code = plain(function).__code__
    what = " ".join((inspect.getdoc(plain(shipped)) or "what the package's method does").split("\n\n")[0].split())
    where = f"{code.co_filename}:{code.co_firstlineno}"
    raise InputError(f"{where}: {owner}.{name} has no return: it must return {what.rstrip('.')}")


def is_packages(function: Callable) -> bool:
    """Whether a function belongs to the package, such as a border to a student's own."""
    code = getattr(plain(function), "__code__", None)
    return code is None or Path(code.co_filename).is_relative_to(PACKAGE)


def gives_nothing(function: Callable) -> bool:
    """Whether a function certainly has no ``return`` with a value; False where its text is unknown."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(plain(function))))
    except (OSError, TypeError, SyntaxError):
        return False
    body = tree.body[0]
    if not isinstance(body, ast.FunctionDef):  # such as a lambda
        return False
    return not any(isinstance(node, (ast.Return, ast.Yield)) and node.value is not None for node in ast.walk(body))


def plain(function: Any) -> Any:
    """The Python function, without the decorators around it."""
    function = getattr(function, "__func__", function)
    while hasattr(function, "__wrapped__"):
        function = function.__wrapped__
    return function
