"""Functions that somebody has written outside of the package: their text, and where they stand."""

import ast
import functools
import inspect
import os
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import taichi

from taichi_tracer.system.errors import OwnCodeError

PACKAGE = f"{Path(__file__).resolve().parents[2]}{os.sep}"  # how the names of the package's own files begin
LIBRARIES = (
    PACKAGE,
    os.path.dirname(str(taichi.__file__)),
    f"{os.sep}site-packages{os.sep}",
    os.path.dirname(os.__file__),
)


def unwrap(function: Any) -> Any:
    """The Python function, without the decorators around it."""
    function = getattr(function, "written", function)
    function = getattr(function, "__func__", function)
    while hasattr(function, "__wrapped__"):
        function = function.__wrapped__
    return function


def is_own_file(file: str) -> bool:
    """Whether a file belongs neither to the package nor to another library."""
    return not file.startswith("<") and not any(library in file for library in LIBRARIES)


def is_own(function: Callable) -> bool:
    """Whether a function stands in a file of somebody's own; the adapters to a student's functions do not."""
    code = getattr(unwrap(function), "__code__", None)
    return code is not None and is_own_file(code.co_filename)


@functools.cache
def tree_of(function: Callable) -> ast.FunctionDef | None:
    """The syntax tree of a function, with the line numbers of its file; None where its text is unknown."""
    try:
        lines, first = inspect.getsourcelines(unwrap(function))
        tree = ast.parse(textwrap.dedent("".join(lines)))
    except (OSError, TypeError, SyntaxError):
        return None
    if not isinstance(tree.body[0], ast.FunctionDef):  # such as a lambda
        return None
    ast.increment_lineno(tree, first - 1)
    return tree.body[0]


def line_of(function: Callable, node: ast.AST | None = None) -> int:
    """The line of a function, or of a node of its tree."""
    tree = tree_of(function)
    return getattr(node, "lineno", unwrap(function).__code__.co_firstlineno if tree is None else tree.lineno)


def place(function: Callable, node: ast.AST | None = None) -> str:
    """Where a function stands, or a node of its tree, as "my_parts.py:12"."""
    return shown_place(unwrap(function).__code__.co_filename, line_of(function, node))


def fault(function: Callable, text: str, node: ast.AST | None = None) -> OwnCodeError:
    """The error for a function, or for a node of its tree."""
    return fault_at(unwrap(function).__code__.co_filename, line_of(function, node), text)


def fault_at(file: str, line: int, text: str) -> OwnCodeError:
    """The error for a line of a file."""
    return OwnCodeError(f"{shown_place(file, line)}: {text}", text, file, line)


def shown_place(file: str, line: int) -> str:
    """A file and a line, as messages show them: from the present folder, or the number of a notebook's cell."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    named = getattr(getattr(shell, "compile", None), "format_code_name", lambda name: None)(file)
    if named is not None:
        return f"{' '.join(named)}, line {line}"
    here = f"{os.getcwd()}{os.sep}"
    return f"{file.removeprefix(here)}:{line}"


def parameters(function: Callable) -> list[inspect.Parameter]:
    """The parameters of a function or method, without ``self``."""
    return [p for p in inspect.signature(unwrap(function)).parameters.values() if p.name != "self"]


def what_it_says(function: Callable) -> str:
    """The first sentence of what the package writes about a method, without the full stop."""
    text = " ".join((inspect.getdoc(unwrap(function)) or "what the package's method does").split("\n\n")[0].split())
    return text.split(". ")[0].rstrip(".").replace("``", "")


def returns(tree: ast.FunctionDef) -> list[ast.Return]:
    """The return statements of a function that give a value."""
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Return) and node.value is not None]
    return [node for node in found if not (isinstance(node.value, ast.Constant) and node.value.value is None)]


def gives_nothing(function: Callable) -> bool:
    """Whether a function certainly returns no value; False where its text is unknown."""
    tree = tree_of(function)
    return tree is not None and not returns(tree) and not any(isinstance(n, ast.Yield) for n in ast.walk(tree))


def is_empty(function: Callable) -> bool:
    """Whether the body of a function is only ``pass``, ``...``, a docstring, or ``return None``."""
    tree = tree_of(function)
    if tree is None:
        return False
    words = [one for one in tree.body if not (isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant))]
    return all(isinstance(one, ast.Pass | ast.Return) for one in words) and not returns(tree)
