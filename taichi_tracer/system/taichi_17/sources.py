"""The sources of functions: read and parsed once.

Wherever a kernel calls a function, Taichi 1.7 finds, reads and parses that function's source again. Here, what was read
and parsed is kept, and a function is found without reading its tokens.
"""

import ast
import functools
import inspect
import linecache
import os
import textwrap
import types
import weakref
from collections.abc import Callable
from typing import Any

import taichi

KEPT_LINES = 1 << 14  # source lines that are kept in a form of their own
TAICHI = os.path.dirname(str(taichi.__file__))  # the folder of its files


def is_short(line: str, width: int) -> bool:
    """Whether a line is wrapped by cutting off its last spaces: it fits, and has no other white space."""
    return len(line) <= width and line.isascii() and line.isprintable()


@functools.lru_cache(KEPT_LINES)
def fill(line: str, width: int = 70, **options: Any) -> str:
    """``textwrap.fill``."""
    text = line.removesuffix("\n")
    return text.rstrip(" ") if is_short(text, width) else textwrap.fill(line, width, **options)


def filling(usual: types.ModuleType) -> types.ModuleType:
    """The module ``textwrap`` for Taichi, with ``fill`` and ``dedent`` that keep what they have made."""
    return with_others(usual, fill=fill, dedent=functools.lru_cache(4096)(textwrap.dedent))


def with_others(module: types.ModuleType, **others: Any) -> types.ModuleType:
    """A module that has some other members, for one that has imported it; the module itself stays as it is."""
    made = types.ModuleType(module.__name__)
    vars(made).update(vars(module) | others)
    return made


def source_lines(function: Callable) -> tuple[list[str], int]:
    """``inspect.getsourcelines`` of a function, which ends at the last line that the compiler has seen.

    If the next line of code belongs to the function as well, ``inspect`` reads the tokens.
    """
    code = getattr(function, "__code__", None)
    if code is None or hasattr(function, "__wrapped__") or not hasattr(code, "co_positions"):
        return inspect.getsourcelines(function)
    linecache.checkcache(code.co_filename)
    lines, first = linecache.getlines(code.co_filename, function.__globals__), code.co_firstlineno
    end = last_line(code)
    codes = (line for line in lines[end:] if line.strip() and not line.lstrip().startswith("#"))
    if indentation(next(codes, "")) > indentation(lines[first - 1]):
        return inspect.getsourcelines(function)
    return lines[first - 1 : end], first


def last_line(code: Any) -> int:
    """The last line of a function and of the functions within it."""
    inner = (last_line(one) for one in code.co_consts if isinstance(one, types.CodeType))
    return max([code.co_firstlineno, *(last for _, last, _, _ in code.co_positions() if last), *inner])


def indentation(line: str) -> int:
    """The number of characters before the first that is no space."""
    return len(line) - len(line.lstrip())


def shorter(usual: Callable, way: Callable) -> Callable:
    """``way``, which does the same as ``usual`` in less time; where it fails, ``usual``."""

    @functools.wraps(usual)
    def found(*words):
        try:
            return way(*words)
        except Exception:
            return usual(*words)

    return found


def kept_per_function(find):
    """``find(function)``, found once for each function."""
    kept = weakref.WeakKeyDictionary()

    @functools.wraps(find)
    def found(function):
        if function not in kept:
            kept[function] = find(function)
        return kept[function]

    return found


def finding_lines(usual: Callable) -> Callable:
    """``getsourcelines``, by a shorter way, and once for each function."""
    return kept_per_function(shorter(usual, source_lines))


class Trees:
    """Syntax trees of sources, which are used again and again.

    Taichi writes into the nodes what it has built from them. Therefore a tree is given back after its use, as it was
    before. Meanwhile, another tree of the same source is made, as for a function that calls itself at compile time.
    """

    def __init__(self) -> None:
        self._free: dict[str, list[ast.AST]] = {}

    def parse(self, source: str) -> ast.AST:
        """The syntax tree of a source, as ``ast.parse`` makes it."""
        free = self._free.setdefault(source, [])
        if free:
            return free.pop()
        tree: Any = ast.parse(source)
        nodes = [node for node in ast.walk(tree) if vars(node)]  # all trees share those without members, as ast.Add()
        tree.source_of_tree = source
        exchanged = ast.FunctionDef, ast.arguments
        tree.parts_of_functions = [(node, dict(vars(node))) for node in nodes if isinstance(node, exchanged)]
        tree.members_of_nodes = None  # so that this member is counted, too
        tree.members_of_nodes = [(vars(node), len(vars(node))) for node in nodes]
        return tree

    def give_back(self, tree: Any) -> None:
        """Let a tree be used again. Taichi adds members to nodes, and exchanges some members of functions."""
        source = getattr(tree, "source_of_tree", None)
        if source is None:
            return
        for members, count in tree.members_of_nodes:
            while len(members) > count:
                members.popitem()  # the member that was added last
        for node, own in tree.parts_of_functions:
            vars(node).update(own)
        self._free[source].append(tree)


TREES = Trees()


def parsing(usual: types.ModuleType) -> types.ModuleType:
    """The module ``ast`` for Taichi, whose ``parse`` gives trees of ``TREES``."""
    return with_others(usual, parse=TREES.parse)


def letting_go(transform: Callable) -> Callable:
    """``transform_tree``, after which its tree can be used again, and the context has no arguments.

    A context belongs to a cycle of objects, which Python finds only when it looks for such cycles. The arrays and the
    scene of a kernel's first call would stay in memory until then.
    """

    @functools.wraps(transform)
    def transformed(tree: ast.AST, context: Any) -> Any:
        try:
            return transform(tree, context)
        finally:
            context.argument_data = ()
            TREES.give_back(tree)

    return transformed
