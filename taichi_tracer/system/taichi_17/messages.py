"""The places that Taichi's messages show, in a shorter form.

For each expression, Taichi 1.7 writes out the source lines that an error message would show, with marks below the
columns; and for each field, all lines of code that made it. Here, a place is the file, the line and its text.
"""

import functools
import linecache
import sys
import types
from collections.abc import Callable
from typing import Any

from taichi_tracer.system.taichi_17.sources import TAICHI

KEPT_PLACES = 1 << 13  # places for messages that are kept
LONG_TEXT = 2000  # characters of a place from which on it is not kept


def describing(_usual: Callable) -> Callable:
    """``ASTTransformerContext.get_pos_info``: the place of a node and the line where it begins."""

    def position(self: Any, node: Any) -> str:
        name, line = self.func.func.__name__, self.src[node.lineno - 1]
        return f'File "{self.file}", line {node.lineno + self.lineno_offset}, in {name}:\n{line}\n'

    return position


def telling_callers(_usual: Callable) -> Callable:
    """``get_traceback``, as some modules of Taichi have it: the line outside of Taichi that makes a field."""

    def place(stacklevel: int = 1) -> str:
        frame: types.FrameType | None = sys._getframe(1)
        while frame is not None and frame.f_code.co_filename.startswith(TAICHI):
            frame = frame.f_back
        if frame is None:
            return ""
        file, number = frame.f_code.co_filename, frame.f_lineno
        return f'  File "{file}", line {number}, in {frame.f_code.co_name}\n{linecache.getline(file, number)}'

    return place


def keeping_places(usual: Callable) -> Callable:
    """``core.DebugInfo``, the place of something for messages, made once for each text."""
    kept = functools.lru_cache(KEPT_PLACES)(usual)

    @functools.wraps(usual, updated=())
    def place(text: str) -> Any:
        return kept(text) if len(text) < LONG_TEXT else usual(text)

    return place
