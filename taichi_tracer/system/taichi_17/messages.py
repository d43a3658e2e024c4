"""The places that Taichi's messages show: written once, and by shorter ways.

For each expression, Taichi 1.7 writes out the source lines that an error message would show, and for each field, the
lines of code that made it. Here, the same texts are put together in less time, and kept.
"""

import ast
import functools
import linecache
import sys
import textwrap
import types
import weakref
from collections.abc import Callable
from typing import Any

from taichi_tracer.system.taichi_17.sources import KEPT_LINES, is_short, shorter

MESSAGE_WIDTH = 80  # characters: where Taichi breaks the source lines of its messages
KEPT_PLACES = 1 << 13  # places for messages that are kept
LONG_TEXT = 2000  # characters of a place from which on it is not kept


@functools.lru_cache(KEPT_LINES)
def wrapped(line: str) -> list[str]:
    """``textwrap.wrap``, for a source line in a message."""
    if not is_short(line, MESSAGE_WIDTH):
        return textwrap.wrap(line, MESSAGE_WIDTH)
    line = line.rstrip(" ")
    return [line] if line else []


def marked(line: str, first: int, last: int) -> str:
    """A source line, and below it a line that marks the columns from ``first`` to before ``last`` (Taichi's form).

    Both are wrapped as texts, each by itself, so that the marks of a line that is too long are in unexpected places.
    """
    code = wrapped(line)
    if not code:
        return "\n\n"
    if first < last <= MESSAGE_WIDTH and len(line) <= MESSAGE_WIDTH:  # the marks are not wrapped
        return f"{code[0]}\n{' ' * first}{'^' * (last - first)}\n"
    marks = wrapped(" " * first + "^" * (last - first) + " " * (len(line) - max(first, last)))
    return "".join([f"{text}\n{mark}\n" for text, mark in zip(code, marks, strict=False)])


def position(self: Any, node: ast.stmt | ast.expr) -> str:
    """``ASTTransformerContext.get_pos_info``: the source lines of a node, as messages show them."""
    text = f'File "{self.file}", line {node.lineno + self.lineno_offset}, in {self.func.func.__name__}:\n'
    begin, end = self.indent + node.col_offset, self.indent + (node.end_col_offset or 0)
    if node.lineno == node.end_lineno:
        return text + marked(self.src[node.lineno - 1], begin, end)
    last_line = node.end_lineno or node.lineno
    if isinstance(node, (ast.For, ast.While, ast.FunctionDef, ast.If)):
        last_line = max(node.body[0].lineno - 1, node.lineno)
    for number in range(node.lineno, last_line + 1):
        line = self.src[number - 1]
        code = line.strip()
        first = begin if number == node.lineno else line.index(code)
        last = end if number == node.end_lineno and number != node.lineno else line.index(code) + len(code)
        text += marked(line, first, last)
    return text


def kept_per_node(describe):
    """``describe(self, node)``, written once for each node of a function's syntax tree.

    A call of a function has a context of its own, in which the descriptions of the function are kept as well.
    """
    kept = weakref.WeakKeyDictionary()

    @functools.wraps(describe)
    def described(self, node):
        descriptions = self.__dict__.get("descriptions")
        if descriptions is None:
            descriptions = self.descriptions = kept.setdefault(self.func.func, {})
        found = descriptions.get(node)
        if found is None:
            found = descriptions[node] = describe(self, node)
        return found

    return described


def describing(usual: Callable) -> Callable:
    """``ASTTransformerContext.get_pos_info``, the source lines of a node: by a shorter way, and once for each node."""
    return kept_per_node(shorter(usual, position))


@functools.lru_cache(KEPT_LINES)
def described_frame(file: str, number: int, function: str) -> str:
    """A line of code and its place, as ``traceback`` writes them."""
    line = linecache.getline(file, number).strip()
    return f'  File "{file}", line {number}, in {function}\n' + (f"    {line}\n" if line else "")


def traceback_text(stacklevel: int = 1) -> str:
    """``taichi.lang.util.get_traceback``: the callers of a function, the outermost first, without the last ones.

    Taichi writes them for every field, because a message about a field would tell where it was made.
    """
    frame: types.FrameType | None = sys._getframe(1 + stacklevel)
    texts = []
    while frame is not None:
        texts.append(described_frame(frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name))
        frame = frame.f_back
    return "".join(reversed(texts))


def telling_callers(_usual: Callable) -> Callable:
    """``get_traceback``, as some modules of Taichi have it."""
    return traceback_text


def keeping_places(usual: Callable) -> Callable:
    """``core.DebugInfo``, the place of something for messages, made once for each text."""
    kept = functools.lru_cache(KEPT_PLACES)(usual)

    @functools.wraps(usual, updated=())
    def place(text: str) -> Any:
        return kept(text) if len(text) < LONG_TEXT else usual(text)

    return place
