"""Grading: marks of a class, whatever its submissions do; on a small assignment in plain Python."""

import hashlib
import os
import socket
import threading
import time
from pathlib import Path

import pytest
from teaching import sums
from teaching.hostile import ATTACKS

from taichi_tracer.teaching import catalogue, walls
from taichi_tracer.teaching.grade import Settings, grade
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
    """The strongest walls of this machine, or those that TAICHI_TRACER_LEVEL names."""
    return best_level(os.environ.get("TAICHI_TRACER_LEVEL"))


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


def graders_processes() -> set[int]:
    """The processes below this one."""
    return set(walls.descendants(os.getpid()))


# ── attacks ──


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", ATTACKS)
def test_an_attack_costs_only_its_own_marks(name, reference, level, listener, place, tmp_path, monkeypatch):
    attack = ATTACKS[name]
    if level.name not in attack.needs:
        pytest.skip(f"the level {level} does not stop this: docs/teaching_security.md")
    port, heard = listener
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "secret.txt").write_text("secret of another student")
    monkeypatch.setenv("TEACHERS_PASSWORD", "1234")
    code = attack.code
    for word, value in (("{victim}", victim), ("{port}", port), ("{pid}", os.getpid()), ("{{name}}", "{name}")):
        code = code.replace(word, str(value))
    others = [reference.expected, fingerprint(victim), fingerprint(Path(walls.__file__).parents[1])]
    processes, start = graders_processes(), time.monotonic()

    mark, _ = grade(reference, handed_in(tmp_path, code), Settings(level, LIMITS, finds=False))

    print(name, [(part.status, part.message) for part in mark.parts])
    assert time.monotonic() - start < MOST_SECONDS
    statuses = {part.name: part.status for part in mark.parts}
    if attack.loses_all:
        assert mark.score == 0
    else:
        assert statuses["Sums.add"] in attack.add, [part.message for part in mark.parts]
        if statuses["Sums.add"] != "right":
            assert earned(mark)["Sums.add"] < 2
        assert earned(mark)["Sums.multiply"] == 5, [part.message for part in mark.parts]
    assert all(part.message.isprintable() and len(part.message) <= 300 for part in mark.parts)
    assert mark.score <= sums.POINTS
    assert [reference.expected, fingerprint(victim), fingerprint(Path(walls.__file__).parents[1])] == others
    assert graders_processes() <= processes
    assert heard == []
