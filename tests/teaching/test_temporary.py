"""Temporary folders: they go with their process, even if it is killed, and those of others stay."""

import os
import signal
import subprocess
import sys
import tempfile

import pytest

from taichi_tracer.teaching import temporary

pytestmark = pytest.mark.skipif(temporary.fcntl is None, reason="this system has no locks that end with a process")
PROCESS = """
import sys
from taichi_tracer.teaching import temporary
made = temporary.folder("x")
(made / "unreadable").mkdir(mode=0)
print(made, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def start(tmp_path, monkeypatch):
    """Starts processes with a folder in ``tmp_path``; (the process, its folder)."""
    environment = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    processes = []

    def started():
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        one = subprocess.Popen([sys.executable, "-c", PROCESS], env=environment, text=True, **pipes)
        processes.append(one)
        return one, one.stdout.readline().strip()

    yield started
    for one in processes:
        one.kill()
        one.communicate()


def test_what_a_killed_process_left_is_removed_by_the_next_one(start):
    killed, left = start()
    alive, kept = start()
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert os.path.isdir(left)
    third, own = start()
    assert not os.path.exists(os.path.dirname(left))
    assert os.path.isdir(kept)  # its process still runs
    third.communicate("")
    assert not os.path.exists(os.path.dirname(own))  # it has ended by itself
    assert alive.poll() is None


def test_folders_that_are_not_ours_stay(tmp_path):
    for name in ("taichi_tracer_other", f"{temporary.PREFIX}unlocked"):
        (tmp_path / name).mkdir()
    (tmp_path / f"{temporary.PREFIX}link").symlink_to(tmp_path / "taichi_tracer_other")
    before = sorted(tmp_path.iterdir())
    temporary.remove_left(tmp_path)
    assert sorted(tmp_path.iterdir()) == before


def test_a_folder_lies_in_the_temporary_one():
    made = temporary.folder("x")
    assert made.parent.parent.samefile(tempfile.gettempdir())
    temporary.remove(made)
    assert not made.exists()
