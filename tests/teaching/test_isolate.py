"""The process of a hand-in: attacks on the grader, how it is asked, how it ends, and which walls this machine has."""

import os
import socket
import threading
import time

import numpy as np
import pytest
from teaching import hostile, sums

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.grading import isolate
from taichi_tracer.teaching.grading.grade import GradingSettings, Reference, grade
from taichi_tracer.teaching.grading.isolate import Limits, best_level, messages, pack, run
from taichi_tracer.teaching.grading.submissions import find

LIMITS = Limits(cpu=3.0, wall=6.0, resident=2 << 30)
LEVELS = isolate.LEVELS
ALWAYS = ("the network", "a file of the others", "500 forks", "memory of many processes", "a gigabyte on stdout")
ALWAYS += ("a changed package", "patched numpy", "patched protocol", "forged frames", "os._exit", "links to outside")
ALWAYS += ("signals to its parents", "daemon that keeps the pipes of a process that ends")
# Zip bombs and names with ".." are in test_submissions.py.


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The small assignment with its answers."""
    folder = tmp_path_factory.mktemp("isolate")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TAICHI_TRACER_CACHE", str(folder / "cache"))
        patch.setenv("TEACHERS_PASSWORD", "x")
        yield Reference(catalogue.load(sums.write_assignment(folder / "sums")), 1)


@pytest.mark.parametrize(
    "name", [name if name in ALWAYS else pytest.param(name, marks=pytest.mark.slow) for name in hostile.ATTACKS]
)
def test_attacks_cost_their_own_part_alone(name, reference, tmp_path):
    attack = hostile.ATTACKS[name]
    level = "limits" if "keeps the pipes" in name else best_level(trust=True)  # bubblewrap ends what leaves a process
    if attack.needs_bwrap and level != "bwrap":
        pytest.skip("limits alone do not stop it")
    (tmp_path / "secret.txt").write_text("secret")
    before = set(isolate.below(os.getpid()))  # such as one that other tests have started
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setblocking(False)
        code = attack.code.replace("{victim}", str(tmp_path)).replace("{pid}", str(os.getpid()))
        code = code.replace("{port}", str(server.getsockname()[1]))
        (handed_in,) = find(sums.zipped(tmp_path / "123456789.zip", {"sums.py": code}), ["sums.py"])
        start = time.monotonic()
        mark = grade(reference, handed_in, GradingSettings(level, LIMITS))
        assert "keeps the pipes" not in name or time.monotonic() - start < 35  # it holds the pipes for longer
        with pytest.raises(BlockingIOError):
            server.accept()
    found = {part.name: part for part in mark.parts}
    assert found["Sums.add"].status in attack.becomes
    assert attack.loses_all or found["Sums.multiply"].status == "right"
    assert (tmp_path / "secret.txt").read_text() == "secret"
    assert not (isolate.PACKAGE / "hacked.py").exists()
    assert set(isolate.below(os.getpid())) <= before


@pytest.mark.slow
@pytest.mark.parametrize("level", LEVELS, ids=str)
def test_a_process_answers_at_every_level(reference, tmp_path, level):
    if isolate.problem_of(level) is not None:
        pytest.skip(f"this machine has no {level}")
    (tmp_path / "sums.py").write_text(sums.submission(add="print('hello')\nreturn a + b"))
    load = {"part": "", "assignment": "assignment/sums", "submission": "submission"}
    requests = [(load, {}), ({"part": "Sums.add"}, {"a": np.ones(20), "b": np.ones(20)})]
    folders = {"submission": tmp_path, "assignment/sums": reference.assignment.folder}
    (_, (reply, arrays)), printed, _, is_late = run(level, LIMITS, requests, folders, threading.Event())
    assert reply["status"] == "ok"
    np.testing.assert_array_equal(arrays["value"], 2 * np.ones(20))
    assert printed.strip() == "hello"
    assert not is_late


def test_an_answer_is_raw_numbers():
    sent = {"a": np.arange(6.0).reshape(2, 3).T, "b": np.array(True), "c": np.zeros((0, 2), np.int8)}
    (facts, found), (other, _) = messages(pack({"x": 1}, sent) + pack({"x": 2}, {}) + b"garbage" + pack({"x": 3}, {}))
    assert (facts, other) == ({"x": 1}, {"x": 2})
    for name, array in sent.items():
        np.testing.assert_array_equal(found[name], array)
    assert list(messages(pack({}, {"a": np.array(["x"]), "b": np.array([print], object)}))) == [({}, {})]
    assert not list(messages(b'[{}, {"a": ["<f8", [1000000000000], "00"]}]'))


def test_the_environment_has_nothing_of_the_teacher(monkeypatch):
    monkeypatch.setenv("PASSWORD", "x")
    found = isolate.environment("/x", "/x/cache")
    assert not {"PASSWORD", "TAICHI_TRACER_CACHE"} & set(found)
    assert found["HOME"] == "/x"


def test_a_container_has_no_network_and_gets_the_package(tmp_path, monkeypatch):
    """The program that runs containers is one that says what it was asked for."""
    (tmp_path / "podman").write_text('#!/bin/sh\necho "$@" >&2\n')
    (tmp_path / "podman").chmod(0o755)
    monkeypatch.setattr(isolate, "ENGINE", f"{tmp_path}/podman")
    answers, printed, reason, _ = run("container teachers", LIMITS, [], {}, threading.Event())
    assert (answers, reason) == ([], "the process ended (exit code 0)")
    words = printed.split()
    volume = f"--volume={isolate.PACKAGE}:{isolate.PACKAGE}:ro"
    assert {"--network", "none", "--read-only", "teachers", volume} <= set(words)
    assert not [word for word in words if word.startswith("--env=PATH")]
    monkeypatch.setattr(isolate, "ENGINE", f"{tmp_path}/docker")  # there is none
    with pytest.raises(InputError, match="--container needs podman or docker"):
        best_level(image="teacher")
