"""The import of Taichi: what it borrows from ``inspect`` is given back, and what it finds there is the same."""

import inspect
import os
import subprocess
import sys
from pathlib import Path

import taichi_tracer
from taichi_tracer.system import importing

PROGRAM = """
import inspect, os
usual = inspect.getframeinfo
from taichi_tracer.system.importing import import_taichi
import_taichi()
import taichi as ti
assert inspect.getframeinfo is usual
assert "TI_LOG_LEVEL" not in os.environ
print(ti.is_logging_effective("info"), ti.is_logging_effective("debug"))
"""


def test_taichi_is_imported_and_nothing_else_is_changed():
    variables = {name: value for name, value in os.environ.items() if name != "TI_LOG_LEVEL"}
    variables |= {"PYTHONPATH": str(Path(taichi_tracer.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=variables, capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()[-2:]) == (0, ["True", "False"]), done.stderr


def test_a_frame_is_described_as_by_the_standard_library():
    frame = sys._getframe()
    assert importing.frame_info(frame)[:4] == inspect.getframeinfo(frame)[:4]  # both are called on one line
    assert importing.frame_info(frame, 3)[3] == inspect.getframeinfo(frame, 3)[3]
    try:
        raise ValueError
    except ValueError as error:
        traceback = error.__traceback__
    assert importing.frame_info(traceback)[:4] == inspect.getframeinfo(traceback)[:4]
