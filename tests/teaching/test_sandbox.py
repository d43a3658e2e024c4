"""The process of a submission: how it is asked, how it ends, and which walls this machine has."""

import os
import threading
import time

import numpy as np
import pytest
from teaching import sums

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import sandbox, walls
from taichi_tracer.teaching.sandbox import ChildEnded, SubmissionProcess, WallLevel, best_level
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
def test_time_of_the_clock_is_limited(assignment, tmp_path):
    child = started(assignment, tmp_path, "import time\ntime.sleep(1000)", wall=0.5)
    with pytest.raises(ChildEnded, match="within 0.5 seconds") as error:
        child.ask(RUN, INPUTS)
    assert error.value.is_late
    assert is_gone(child)


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


def test_limits_alone_are_taken_by_trust_only(best):
    assert best("bwrap", trust=True) == "limits"
    with pytest.raises(InputError, match="a reason; .*--trust"):
        best("bwrap")
    with pytest.raises(InputError, match="a reason$"):
        best("bwrap", "limits", trust=True)
