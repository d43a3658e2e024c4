"""Walls: what of the world a submission sees; tried at each level in test_sandbox.py and test_grade.py."""

import os
import subprocess
import sys
import time

import pytest

from taichi_tracer.teaching import walls
from taichi_tracer.teaching.walls import Limits, Surroundings


@pytest.mark.parametrize(
    ("paths", "kept"),
    [
        (["/usr/lib", "/usr"], ["/usr"]),
        (["/usr", "/usr/", "/usr/../usr"], ["/usr"]),
        (["/usr", "/usrlocal-that-is-not-there"], ["/usr"]),
        ([], []),
    ],
)
def test_paths_within_others_are_shown_once(paths, kept):
    assert walls.outermost(paths) == kept


def test_the_words_of_bubblewrap(tmp_path):
    words = walls.bwrap_command(Surroundings("bwrap", str(tmp_path), ("/usr/lib/python3",)))
    assert words[0] == "bwrap"
    assert "--unshare-all" in words
    at = words.index(str(tmp_path))
    assert words[at - 1] == "--ro-bind"
    assert "--bind" not in words


def test_the_folder_to_write_in():
    assert Surroundings("limits", "/x").folder == "/x"
    assert Surroundings("bwrap", "/x").folder == walls.WORK
    assert not os.path.exists(walls.WORK), "it would hide what is there, such as the package"


def test_a_call_that_fails_is_told():
    with pytest.raises(OSError, match="capset"):
        walls.checked("capset", -1)
    walls.checked("capset", 0)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells of processes by files")
def test_processes_below_this_one_are_found():
    with subprocess.Popen(["sleep", "100"]) as process:
        try:
            assert process.pid in walls.descendants(os.getpid())
            deadline = time.monotonic() + 20
            while not walls.descendants(os.getpid())[process.pid]:  # while its program is replaced, it has no memory
                assert time.monotonic() < deadline, "it never got memory"
                time.sleep(0.01)
            assert walls.tasks_of(os.getuid()) >= 2
        finally:
            process.kill()
    assert process.pid not in walls.descendants(os.getpid())


@pytest.mark.skipif(os.name != "posix", reason="no limits on Windows")
def test_limits_cannot_be_raised_again():
    code = (
        "import resource, sys; from taichi_tracer.teaching import walls\n"
        "walls.set_limits(walls.Limits(), 1000); walls.allow_cpu(5)\n"
        "print(resource.getrlimit(resource.RLIMIT_FSIZE), resource.getrlimit(resource.RLIMIT_CPU)[0] >= 5)"
    )
    path = os.pathsep.join(p for p in sys.path if p)
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={"PYTHONPATH": path})
    assert found.stdout.strip() == f"({Limits().file}, {Limits().file}) True", found.stderr
