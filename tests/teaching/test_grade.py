"""Grading: marks of a class, whatever its submissions do; on a small assignment in plain Python."""

import contextlib
import hashlib
import os
import socket
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from teaching import sums
from teaching.hostile import ATTACKS

from taichi_tracer.teaching import catalogue, walls
from taichi_tracer.teaching import grade as grading
from taichi_tracer.teaching.grade import GradingSettings, Stop, grade, grade_class
from taichi_tracer.teaching.marks import Rules
from taichi_tracer.teaching.reference import Reference
from taichi_tracer.teaching.sandbox import best_level
from taichi_tracer.teaching.submissions import find
from taichi_tracer.teaching.walls import Limits

LIMITS = Limits(cpu=3.0, wall=6.0, resident=2 << 30)
MOST_SECONDS = 60.0  # of an attack on one part: two processes, and its limit


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder, in which the cache of these tests is, too."""
    folder = tmp_path_factory.mktemp("grade")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TAICHI_TRACER_CACHE", str(folder / "cache"))
        yield folder


@pytest.fixture(scope="module")
def assignment(place):
    """The small assignment."""
    return catalogue.load(sums.write_assignment(place / "sums"))


@pytest.fixture(scope="module")
def level():
    """The strongest walls of this machine, or of the level that TAICHI_TRACER_LEVEL names."""
    with pytest.MonkeyPatch.context() as patch:
        if "TAICHI_TRACER_LEVEL" in os.environ:
            patch.setattr(walls, "LEVELS", (os.environ["TAICHI_TRACER_LEVEL"],))
        return best_level.__wrapped__(trust=True)


@pytest.fixture(scope="module")
def reference(assignment):
    """The solution's answers."""
    with Reference(assignment, 1) as found:
        yield found


@pytest.fixture(scope="module")
def listener():
    """A server on this machine; what it was sent."""
    server, heard = socket.create_server(("127.0.0.1", 0)), []

    def listen():
        while True:
            try:
                heard.append(server.accept()[0].recv(100))
            except OSError:
                return

    threading.Thread(target=listen, daemon=True).start()
    yield server.getsockname()[1], heard
    server.close()


def handed_in(folder: Path, code: str, student: str = "123456789", **files: str):
    """A submission of one student as a zip file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = sums.zipped(folder / f"{student}.zip", {"sums.py": code, **files})
    return find(path, ["sums.py"])[0]


def earned(mark) -> dict[str, float]:
    """Part → points."""
    return {part.name: part.earned for part in mark.parts}


def fingerprint(folder: Path) -> dict[str, str]:
    """File → hash of its content."""
    files = sorted(p for p in folder.rglob("*") if p.is_file() and "__pycache__" not in p.parts)
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def submissions_processes(place: Path) -> set[int]:
    """The processes of submissions that these tests have started, wherever they belong by now."""
    found = set()
    for process in walls.processes():
        with contextlib.suppress(OSError):
            if str(place).encode() in Path(f"/proc/{process}/cmdline").read_bytes():
                found.add(process)
    return found - {os.getpid()}


# ── attacks ──


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", ATTACKS)
def test_an_attack_costs_only_its_own_marks(name, reference, level, listener, place, tmp_path, monkeypatch):
    attack = ATTACKS[name]
    if attack.needs_bwrap and level.name != "bwrap":
        pytest.skip(f"bubblewrap stops this, and the walls here are {level}: docs/teaching_security.md")
    port, heard = listener
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "secret.txt").write_text("secret of another student")
    monkeypatch.setenv("TEACHERS_PASSWORD", "1234")
    code = attack.code
    for word, value in (("{victim}", victim), ("{port}", port), ("{pid}", os.getpid()), ("{{name}}", "{name}")):
        code = code.replace(word, str(value))
    others = [reference.expected, fingerprint(victim), fingerprint(Path(walls.__file__).parents[1])]
    start = time.monotonic()

    mark, _ = grade(reference, handed_in(tmp_path, code), GradingSettings(level, LIMITS, finds=False))

    print(name, [(part.status, part.message) for part in mark.parts])
    assert time.monotonic() - start < MOST_SECONDS
    statuses = {part.name: part.status for part in mark.parts}
    if attack.loses_all:
        assert mark.score == 0
    else:
        assert statuses["Sums.add"] in attack.becomes, [part.message for part in mark.parts]
        if statuses["Sums.add"] != "right":
            assert earned(mark)["Sums.add"] < 2
        assert earned(mark)["Sums.multiply"] == 5, [part.message for part in mark.parts]
    assert all(part.message.isprintable() and len(part.message) <= 300 for part in mark.parts)
    assert mark.score <= sums.POINTS
    assert [reference.expected, fingerprint(victim), fingerprint(Path(walls.__file__).parents[1])] == others
    assert submissions_processes(place) == set()
    assert heard == []


# ── a class ──

WRONG = sums.submission(add="return a - b")
HALF = sums.submission(add="import numpy as np\nreturn np.where(np.arange(20) < 10, a + b, 0)")
CRASHES = sums.submission(subtract="import os\nos._exit(3)")


@pytest.fixture(scope="module")
def classroom(place):
    """A folder with the submissions of six students."""
    folder = place / "class"
    codes = {"123456781": sums.submission(), "123456782": WRONG, "123456783": HALF, "123456784": CRASHES}
    for student, code in codes.items():
        handed_in(folder, code, student)
    sums.zipped(folder / "Ann.zip", {"a/sums.py": sums.submission(), "__MACOSX/._sums.py": "x"})
    sums.zipped(folder / "123456785.zip", {"../sums.py": sums.submission()})
    return folder


@pytest.fixture(scope="module")
def marks(assignment, classroom, level):
    """Their marks."""
    return grade_class(assignment, find(classroom, assignment.files), Rules(), GradingSettings(level, LIMITS))


def points(marks) -> dict[str, dict[str, float]]:
    """Student → part → points."""
    return {mark.student: earned(mark) for mark in marks}


@pytest.mark.long
def test_each_student_gets_what_is_right(marks):
    by = {mark.student: mark for mark in marks}
    assert earned(by["123456781"]) == earned(by["Ann"]) == sums.RIGHT
    assert earned(by["123456782"]) == sums.RIGHT | {"Sums.add": 0}
    assert earned(by["123456783"]) == sums.RIGHT | {"Sums.add": pytest.approx(0.95, abs=0.01)}
    assert earned(by["123456784"]) == sums.RIGHT | {"Sums.subtract": 0}
    assert by["123456785"].score == 0
    assert "leads out of the folder" in by["123456785"].refused
    (part,) = [part for part in by["123456782"].parts if part.status == "wrong"]
    assert set(part.first_wrong) == {"input", "yours", "right"}
    assert "exit code 3" in by["123456784"].parts[1].message


@pytest.mark.long
def test_marks_do_not_depend_on_order_or_jobs(marks, assignment, classroom, level):
    backwards = list(reversed(find(classroom, assignment.files)))
    again = grade_class(assignment, backwards, Rules(), GradingSettings(level, LIMITS, jobs=3, anew=True))
    assert [mark.student for mark in again] == [one.student for one in backwards]
    assert points(again) == points(marks)
    without_seconds = [[(part.status, part.message, part.first_wrong) for part in mark.parts] for mark in again[::-1]]
    assert without_seconds == [[(p.status, p.message, p.first_wrong) for p in mark.parts] for mark in marks]


@pytest.mark.long
def test_what_was_graded_is_not_graded_again(marks, assignment, classroom, level, monkeypatch):
    monkeypatch.setattr(grading, "SubmissionProcess", None)
    found = find(classroom, assignment.files)
    assert points(grade_class(assignment, found, Rules(), GradingSettings(level, LIMITS))) == points(marks)


@pytest.mark.exhaustive
def test_another_seed_has_other_inputs_and_the_same_marks(marks, assignment, classroom, level):
    (one,) = [one for one in find(classroom, assignment.files) if one.student == "123456782"]
    (mark,) = grade_class(assignment, [one], Rules(), GradingSettings(level, LIMITS, seed=7))
    first = next(mark for mark in marks if mark.student == "123456782")
    assert earned(mark) == earned(first)
    assert mark.parts[0].first_wrong != first.parts[0].first_wrong


@pytest.mark.exhaustive
def test_hard_coded_answers_fail(reference, level, tmp_path):
    values = (reference.inputs["Sums.add"]["a"] + reference.inputs["Sums.add"]["b"]).tolist()
    code = sums.submission("import numpy as np", f"return np.array({values})")
    mark, _ = grade(reference, handed_in(tmp_path, code), GradingSettings(level, LIMITS))
    assert earned(mark) == sums.RIGHT
    with Reference(reference.assignment, 2) as other:
        mark, _ = grade(other, handed_in(tmp_path, code), GradingSettings(level, LIMITS, finds=False))
    assert earned(mark)["Sums.add"] == 0


@pytest.mark.exhaustive
def test_a_stopped_grading_ends_soon_and_keeps_nothing(reference, assignment, level, tmp_path):
    slow = handed_in(tmp_path, sums.submission(add="import time\ntime.sleep(1000)"))
    stop, start = Stop(), time.monotonic()
    threading.Timer(2.0, stop.set).start()
    settings = GradingSettings(level, Limits(wall=500))
    mark = grading.grade_or_read(reference, slow, settings, stop)
    assert time.monotonic() - start < 20
    assert mark.score == 0
    assert grading.read(grading.kept_at(assignment, slow, settings.seed)) is None


def test_what_a_stranger_says_cannot_change_a_terminal():
    assert grading.clean("a\x1b[2J\r\nb\u202e") == "a\N{REPLACEMENT CHARACTER}[2J" + "\N{REPLACEMENT CHARACTER}" * 2 + (
        "b\N{REPLACEMENT CHARACTER}"
    )
    assert len(grading.clean("x" * 1000)) == grading.LONGEST_MESSAGE
    assert len(grading.cut("x" * 10_000)) < 2100


@pytest.mark.parametrize(
    "answers",
    [
        {},
        {"value": np.zeros((2, 2))},
        {"value": np.full(20, np.nan)},
        {"value": np.zeros(20, bool)},
        {"value": np.array(1)},
        {"other": np.zeros(20)},
        {"value": np.zeros((0,) * 8)},
    ],
)
def test_any_answer_has_a_verdict(answers, assignment):
    part = assignment.parts[0]
    inputs = assignment.inputs(part, 1)
    verdict = grading.judged(part, inputs, answers, {"value": inputs["a"] + inputs["b"]})
    assert verdict.status in ("wrong", "crashed")
    assert verdict.share == 0
