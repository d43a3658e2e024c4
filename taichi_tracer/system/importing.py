"""The import of Taichi, in two thirds of its time and without its line about graphical shells.

For each of its own functions with ``@ti.func``, Taichi asks ``inspect`` for the source line at which a frame stands,
and ``inspect`` searches all modules for the file that the frame already knows: a quarter of the time of the import.
Therefore ``inspect`` has ``frame_info`` in place of this search while Taichi is imported.
"""

import importlib
import inspect
import linecache
import os
import sys
import types

_of_the_standard_library = inspect.getframeinfo


def import_taichi() -> None:
    """Import Taichi, unless it is imported already.

    Its line "Graphical python shell detected" is not shown, because every notebook would show it in red. Taichi's
    warnings and errors are shown, and a level that the user has set is kept.
    """
    if "taichi" in sys.modules:
        return
    is_level_chosen = "TI_LOG_LEVEL" in os.environ  # Taichi reads it when it is imported
    if not is_level_chosen:
        os.environ["TI_LOG_LEVEL"] = "warn"
    inspect.getframeinfo = frame_info  # type: ignore[assignment]
    try:
        taichi = importlib.import_module("taichi")
    finally:
        inspect.getframeinfo = _of_the_standard_library
        if not is_level_chosen:
            del os.environ["TI_LOG_LEVEL"]
    if not is_level_chosen:
        taichi.set_logging_level(taichi.INFO)


def frame_info(frame: types.FrameType, context: int = 1) -> inspect.Traceback:
    """``inspect.getframeinfo`` of a frame and one line, without the search for its module."""
    if not isinstance(frame, types.FrameType) or context != 1:
        return _of_the_standard_library(frame, context)
    name, number = frame.f_code.co_filename, frame.f_lineno
    line = linecache.getline(name, number, frame.f_globals)
    return inspect.Traceback(name, number, frame.f_code.co_name, [line], 0)
