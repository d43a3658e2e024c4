"""Imports of Taichi and of this package, in two thirds of their time.

For each function with ``@ti.func``, Taichi asks ``inspect`` for the source line at which a frame stands, and
``inspect`` searches all modules for the file that the frame already knows: a quarter of the time. Therefore
``inspect.getframeinfo`` is ``frame_info`` while these imports go on. Nothing of Taichi is replaced.
"""

import contextlib
import importlib
import inspect
import linecache
import os
import sys
import types
from collections.abc import Iterator

from taichi_tracer.system.errors import InputError

_of_the_standard_library = inspect.getframeinfo


def import_quickly(name: str) -> types.ModuleType:
    """Import a module of this package, and Taichi if the module needs it."""
    with quick_imports():
        return importlib.import_module(name)


def import_extra(name: str, advice: str) -> types.ModuleType:
    """Import a module that the package does not depend on; an InputError with ``advice`` where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(advice) from None


@contextlib.contextmanager
def quick_imports() -> Iterator[None]:
    """A context in which modules may import Taichi: it takes less time, and prints nothing.

    Taichi's line "Graphical python shell detected" is not shown, because every notebook would show it in red. Taichi's
    warnings and errors are shown, and a level that the user has set is kept.
    """
    is_first, level = "taichi" not in sys.modules, os.environ.get("TI_LOG_LEVEL")
    former = inspect.getframeinfo
    inspect.getframeinfo = frame_info  # type: ignore[assignment]
    if is_first:
        os.environ["TI_LOG_LEVEL"] = level or "warn"  # Taichi reads it when it is imported
    try:
        yield
        if is_first and "taichi" in sys.modules:
            importlib.import_module("taichi.lang.matrix_ops")  # Taichi itself does it while the first kernel is read
    finally:
        inspect.getframeinfo = former
        if is_first and level is None:
            os.environ.pop("TI_LOG_LEVEL", None)
            if "taichi" in sys.modules:
                sys.modules["taichi"].set_logging_level(sys.modules["taichi"].INFO)


def frame_info(frame: types.FrameType, context: int = 1) -> inspect.Traceback:
    """``inspect.getframeinfo`` of a frame and one line, without the search for its module."""
    if not isinstance(frame, types.FrameType) or context != 1:
        return _of_the_standard_library(frame, context)
    name, number = frame.f_code.co_filename, frame.f_lineno
    line = linecache.getline(name, number, frame.f_globals)
    return inspect.Traceback(name, number, frame.f_code.co_name, [line], 0)
