"""The adapter to the code of the Taichi course: its files, its ids from 1, and renderers that only it has.

A file has the adapters of one subject, so that no other folder knows the course's conventions. Add a class that
students write to ``adapters.py``.

``tt.course("A1_codebase/taichi_tracer")`` uses a student's files in all pictures of this process, see ``use.Course``::

    with tt.course("A1_codebase/taichi_tracer") as files:
        print(files)
        tt.A1Renderer(tt.load_scene_data("cornell_box"), 256, 256).use("normal").image()
"""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """A module that is called as its function ``use.use``."""

    def __call__(self, folder: str | Path) -> Any:
        """Use a student's files; see ``use.Course``."""
        from taichi_tracer.course.use import use

        return use(folder)


sys.modules[__name__].__class__ = _Callable
