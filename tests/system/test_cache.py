"""The cache of compiled kernels: a home that cannot be written must not end the process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import taichi_tracer
from taichi_tracer.system import runtime as cache

PROGRAM = """
import taichi_tracer as tt
tt.init("cpu")
scene = tt.scene_from_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], intersector="brute_force")
print(int(scene.occluded([0.2, 0.2, 1], [0, 0, -1])[0]))
"""


@pytest.fixture
def file_in_the_way(tmp_path):
    """A home whose .cache is a file."""
    (tmp_path / ".cache").write_text("")
    return tmp_path


def test_where_nothing_can_be_written_there_is_none(file_in_the_way):
    folder, told = cache.cache_folder(file_in_the_way / ".cache" / "taichi")
    assert folder is None
    assert "compiled anew" in told


@pytest.mark.parametrize("home", ["file in the way", "none"])
def test_a_process_ends_well_without_a_home(home, file_in_the_way, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    settings = {
        name: value
        for name, value in os.environ.items()
        if name not in ("HOME", "XDG_CACHE_HOME", "TI_OFFLINE_CACHE_FILE_PATH")
    }
    settings |= {"PYTHONPATH": str(Path(taichi_tracer.__file__).parent.parent)}
    if home == "file in the way":
        settings["HOME"] = str(file_in_the_way)
    done = subprocess.run([sys.executable, program], env=settings, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["1"]
    assert ("cannot be written" in done.stderr) == (home == "file in the way")
