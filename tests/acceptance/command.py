"""The command line, run in this process or in one of its own."""

import os
import subprocess
import sys
from pathlib import Path
from unittest import mock

import taichi_tracer as tt
from taichi_tracer.__main__ import main


def command(*words) -> int:
    """The exit code of ``taichi-tracer WORDS``, in this process."""
    with mock.patch.object(sys, "argv", ["taichi-tracer", *map(str, words)]):
        try:
            return main()
        except SystemExit as ended:
            return ended.code


def process(*words, folder: Path, **variables) -> subprocess.CompletedProcess:
    """``python WORDS`` in a process and in a folder of its own, with this package."""
    paths = [str(Path(tt.__file__).parents[1]), str(Path(__file__).parents[1])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)} | variables
    words = [sys.executable, *map(str, words)]
    return subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, timeout=280)
