"""The cache of compiled kernels: a home that cannot be written must not end the process."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import taichi_tracer
from taichi_tracer.system import cache

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


def test_a_folder_that_can_be_written_is_taken(tmp_path):
    assert cache.cache_folder(tmp_path / "a" / "b") == (tmp_path / "a" / "b", None)


def test_an_old_lock_is_removed_and_one_that_is_held_stays(tmp_path):
    lock = tmp_path / cache.LOCK
    lock.touch()
    cache.cache_folder(tmp_path)
    assert lock.exists()
    long_ago = time.time() - 2 * cache.OLD
    os.utime(lock, (long_ago, long_ago))
    cache.cache_folder(tmp_path)
    assert not lock.exists()


def test_processes_write_one_after_the_other(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    other = (tmp_path / cache.TURNS).open("w")  # a lock belongs to an open file, not to a process
    with cache.only_writer(tmp_path), pytest.raises(BlockingIOError):
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    other.close()
    with cache.only_writer(tmp_path / "none"):
        pass  # a folder that is gone keeps nobody from ending


def test_the_folder_of_taichis_environment_variable_is_used(tmp_path):
    """Kernels are kept there, and nothing is printed about it."""
    place = tmp_path / "kernels"
    environment = {**os.environ, cache.VARIABLE: str(place), "PYTHONPATH": str(Path(taichi_tracer.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "1"
    assert cache.VARIABLE not in done.stdout + done.stderr
    assert list(place.rglob("*.tic"))


def test_another_is_found_and_told(file_in_the_way, tmp_path, monkeypatch):
    monkeypatch.setattr(cache.tempfile, "gettempdir", lambda: str(tmp_path))
    folder, told = cache.cache_folder(file_in_the_way / ".cache" / "taichi")
    assert folder.parent == tmp_path
    assert "Not a directory" in told
    assert str(folder) in told


def test_where_nothing_can_be_written_there_is_none(file_in_the_way, monkeypatch):
    monkeypatch.setattr(cache.tempfile, "gettempdir", lambda: str(file_in_the_way / ".cache"))
    folder, told = cache.cache_folder(file_in_the_way / ".cache" / "taichi")
    assert folder is None
    assert "compiled anew" in told


@pytest.mark.skipif(not hasattr(os, "symlink") or os.name != "posix", reason="links of POSIX")
def test_a_link_in_the_temporary_folder_is_not_trusted(file_in_the_way, tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / f"taichi_tracer_cache_{cache.user_number()}").symlink_to(tmp_path / "elsewhere")
    monkeypatch.setattr(cache.tempfile, "gettempdir", lambda: str(tmp_path))
    assert cache.cache_folder(file_in_the_way / ".cache" / "taichi")[0] is None


@pytest.mark.parametrize("home", ["file in the way", "none"])
def test_a_process_ends_well_without_a_home(home, file_in_the_way, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    settings = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME")}
    settings |= {"PYTHONPATH": str(Path(taichi_tracer.__file__).parent.parent)}
    if home == "file in the way":
        settings["HOME"] = str(file_in_the_way)
    done = subprocess.run([sys.executable, program], env=settings, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["1"]
    assert ("cannot be written" in done.stderr) == (home == "file in the way")
