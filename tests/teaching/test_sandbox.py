"""The process of a submission: how it is asked, how it ends, and which walls this machine has."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from teaching import sums

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import sandbox, temporary, walls
from taichi_tracer.teaching.sandbox import ChildEnded, SubmissionProcess, WallLevel, best_level, ended
from taichi_tracer.teaching.walls import Limits

INPUTS = {"a": np.ones(20), "b": np.ones(20)}
RUN = {"do": "run", "part": "Sums.add"}
LEVELS = [level for level in sandbox.candidates() if os.name == "posix"]


@pytest.fixture(scope="module")
def assignment(tmp_path_factory):
    """The folder of a small assignment."""
    return sums.write_assignment(tmp_path_factory.mktemp("sandbox") / "sums")


@pytest.fixture(params=LEVELS, ids=str)
def level(request):
    """Every level that works on this machine."""
    if sandbox.problem_of(request.param, starts_taichi=False) is not None:
        pytest.skip(f"this machine has no {request.param}")
    return request.param


def started(assignment, tmp_path, add: str, level: WallLevel | None = None, **limits) -> SubmissionProcess:
    """A process that has loaded a submission, without Taichi."""
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "sums.py").write_text(sums.submission(add=add))
    child = SubmissionProcess(tmp_path / "files", level or WallLevel("limits"), Limits(**limits), outline=assignment)
    request = {
        "do": "load",
        "assignment": "assignment/sums",
        "folder": "submission",
        "starts_taichi": False,
    }
    child.ask(request, wall=100)
    return child


def is_gone(child: SubmissionProcess) -> bool:
    """Whether nothing is left of a process."""
    return child._process.poll() is not None and not child.given.exists()


@pytest.mark.slow
def test_a_process_answers_at_every_level(assignment, tmp_path, level):
    with started(assignment, tmp_path, "print('hello')\nreturn a + b", level) as child:
        reply, arrays = child.ask(RUN, INPUTS)
        assert reply["status"] == "ok"
        np.testing.assert_array_equal(arrays["value"], 2 * np.ones(20))
    assert child.output.strip() == "hello"
    assert is_gone(child)


@pytest.mark.slow
def test_memory_is_watched_at_every_level(assignment, tmp_path, level):
    add = "import time\nimport numpy as np\nkept = np.ones(80_000_000)\ntime.sleep(100)"
    child = started(assignment, tmp_path, add, level, resident=400 << 20)
    with pytest.raises(ChildEnded, match="more than 0.391 GiB of memory"):
        child.ask(RUN, INPUTS)
    assert is_gone(child)


@pytest.mark.slow
def test_a_process_ends_when_it_has_to_at_every_level(assignment, tmp_path, level):
    child = started(assignment, tmp_path, "import time\ntime.sleep(1000)", level, wall=500)
    start = time.monotonic()
    threading.Timer(0.3, child.hurry).start()
    with pytest.raises(ChildEnded):
        child.ask(RUN, INPUTS)
    assert time.monotonic() - start < 4
    assert is_gone(child)


@pytest.mark.slow
def test_time_of_the_processor_is_limited(assignment, tmp_path):
    child = started(assignment, tmp_path, "while True: pass", cpu=0.5, wall=60)
    with pytest.raises(ChildEnded, match="0.5 seconds of the processor") as error:
        child.ask(RUN, INPUTS)
    assert error.value.is_late
    assert is_gone(child)


@pytest.mark.slow
def test_time_of_the_clock_is_limited(assignment, tmp_path):
    child = started(assignment, tmp_path, "import time\ntime.sleep(1000)", wall=0.5)
    with pytest.raises(ChildEnded, match="within 0.5 seconds") as error:
        child.ask(RUN, INPUTS)
    assert error.value.is_late
    assert is_gone(child)


@pytest.mark.slow
def test_prints_are_cut(assignment, tmp_path):
    with started(assignment, tmp_path, "print('x' * 3_000_000)\nreturn a + b") as child:
        assert child.ask(RUN, INPUTS)[0]["status"] == "ok"
    assert len(child.output) < Limits().output + 100
    assert child.output.endswith("(cut)")


@pytest.mark.parametrize(
    ("facts", "told", "is_late"),
    [
        ({"exit": 3}, "exit code 3", False),
        ({"signal": signal.SIGSEGV}, "SIGSEGV", False),
        ({"exit": 128 + signal.SIGSEGV}, "SIGSEGV", False),
        ({"signal": signal.SIGXCPU}, "seconds of the processor", True),
        ({"memory": 1}, "3 GiB of memory", False),
        ({"processes": 200}, "200 processes, of which 96", False),
        ({"failed": "no"}, "could not be started: no", False),
        ({"exit": None}, "exit code None", False),
    ],
)
def test_how_a_process_ended_is_told(facts, told, is_late):
    error = ended(facts, Limits())
    assert told in str(error)
    assert error.is_late is is_late


def test_the_environment_has_nothing_of_the_teacher(monkeypatch):
    monkeypatch.setenv("PASSWORD", "x")
    found = sandbox.environment(walls.Surroundings("limits", "/x"), is_trusted=False)
    assert "PASSWORD" not in found
    assert "TAICHI_TRACER_CACHE" not in found
    assert found["HOME"] == "/x"


@pytest.fixture
def best(monkeypatch):
    """A function: the best level, where some names of levels do not work."""

    def best(*broken: str, trust: bool = False) -> str:
        monkeypatch.setattr(sandbox, "problem_of", lambda level: "a reason" if level.name in broken else None)
        return best_level.__wrapped__(trust).name

    return best


def test_the_stronger_level_is_taken(best):
    assert best() == best(trust=True) == "bwrap"


def test_limits_alone_are_taken_by_trust_only(best):
    assert best("bwrap", trust=True) == "limits"
    with pytest.raises(InputError, match="a reason; .*--trust"):
        best("bwrap")
    with pytest.raises(InputError, match="a reason$"):
        best("bwrap", "limits", trust=True)


@pytest.mark.skipif(sys.platform != "linux", reason="bubblewrap runs on Linux only")
def test_why_bubblewrap_does_not_work_is_one_line_with_a_remedy(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "apt-get install bubblewrap" in sandbox.problem_of.__wrapped__(WallLevel("bwrap"))
    refusing = tmp_path / "bwrap"  # as a container does that allows no namespaces
    refusing.write_text("#!/bin/sh\necho 'bwrap: No permissions\n to create new namespace'\nexit 1\n")
    refusing.chmod(0o755)
    problem = sandbox.problem_of.__wrapped__(WallLevel("bwrap"), starts_taichi=False)
    assert "a container refuses namespaces" in problem
    assert problem.endswith("(bwrap: No permissions to create new namespace)")


def test_the_working_folder_is_not_on_the_path(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert str(tmp_path) not in sandbox.python_path()
    assert "" not in sandbox.python_path()


def test_paths_lead_through_no_folder_that_the_walls_hide(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(f"{tmp_path}/hidden/../shown")
    assert f"{tmp_path}/shown" in sandbox.python_path()


ORPHAN = """
import sys
from pathlib import Path
import numpy as np
from taichi_tracer.teaching import sandbox
from taichi_tracer.teaching.walls import Limits
folder, assignment, level, user = sys.argv[1:]
walls = sandbox.WallLevel(level, user == "True")
child = sandbox.SubmissionProcess(Path(folder), walls, Limits(wall=400), outline=Path(assignment))
child.ask({"do": "load", "assignment": "assignment/sums", "folder": "submission", "starts_taichi": False}, wall=100)
print(child.given, flush=True)
child.ask({"do": "run", "part": "Sums.add"}, {"a": np.ones(20), "b": np.ones(20)})
"""


@pytest.mark.slow
def test_everything_ends_with_the_grader_at_every_level(assignment, tmp_path, level):
    """The grader is ended by a signal that it cannot notice, while a daemon of the submission runs."""
    add = "import os, time\nif os.fork() == 0:\n    os.setsid()\ntime.sleep(1000)"
    (tmp_path / "sums.py").write_text(sums.submission(add=add))
    words = [sys.executable, "-c", ORPHAN, str(tmp_path), str(assignment), level.name, str(level.user)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment) as grader:
        given = grader.stdout.readline().strip()
        time.sleep(1.0)
        assert len(processes_with(given)) >= 2
        grader.kill()
    deadline = time.monotonic() + 10
    while processes_with(given) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert processes_with(given) == []
    temporary.remove(given)


def processes_with(word: str) -> list[int]:
    """The processes that have a word in their arguments."""
    found = []
    for process in walls.processes():
        with contextlib.suppress(OSError):
            if word.encode() in Path(f"/proc/{process}/cmdline").read_bytes():
                found.append(process)
    return found
