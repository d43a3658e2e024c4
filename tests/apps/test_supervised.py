"""A check whose parts never answer, or end their process: the other parts are checked, and the page is written."""

import os
import signal
import subprocess
import sys
import time

import pytest
from teaching import sums

from taichi_tracer.apps import supervised
from taichi_tracer.apps.cli import main
from taichi_tracer.teaching.telling import Told, summary

pytestmark = pytest.mark.skipif(os.name != "posix", reason="elsewhere, a check runs in the process that is asked")


@pytest.fixture
def assignment(tmp_path):
    return sums.write_assignment(tmp_path / "sums")


def words(tmp_path, assignment, **bodies):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "sums.py").write_text(sums.submission(**bodies))
    return ["check", str(tmp_path / "mine"), "--assignment", str(assignment)]


def test_a_part_that_ends_the_process_costs_itself_alone(tmp_path, assignment, capfd):
    asked = words(tmp_path, assignment, add="import os; os._exit(3)", subtract="return a")
    assert main(asked) == 1
    out = capfd.readouterr().out
    assert out.count("# Sums") <= 1
    assert "line 4 of sums.py: the process ended (exit code 3)" in out
    assert "1 of 3 parts are right: 5" in out
    page = (tmp_path / "mine" / "check.html").read_text()
    assert [name in page for name in ("Sums.add", "Sums.subtract", "Sums.multiply")] == [True] * 3


@pytest.mark.long
def test_a_loop_that_never_ends_is_told_with_its_line(tmp_path, assignment, capfd, monkeypatch):
    monkeypatch.setattr(supervised, "CPU_SECONDS", 6.0)
    assert main(words(tmp_path, assignment, add="while True:\n    pass")) == 1
    out = capfd.readouterr().out
    assert "line 4 of sums.py: no answer in 6 s of the processor: is there a loop that never ends?" in out
    assert "2 of 3 parts are right: 8 of 10 points" in out


@pytest.mark.exhaustive
def test_files_that_never_end_are_told(tmp_path, assignment, capfd, monkeypatch):
    monkeypatch.setattr(supervised, "CPU_SECONDS", 6.0)
    assert main(words(tmp_path, assignment, top="while True:\n    pass")) == 2
    assert "the files cannot be read: no answer in 6 s" in capfd.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_everything_within_a_second(tmp_path, assignment, number):
    command = [sys.executable, "-m", "taichi_tracer", *words(tmp_path, assignment, add="while True:\n    pass")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline().strip() == "Sums"
    time.sleep(2)  # the endless part has begun
    start = time.monotonic()
    process.send_signal(number)
    assert process.wait(10) == 128 + number
    assert time.monotonic() - start < 1
    children = subprocess.run(["pgrep", "-f", str(assignment)], capture_output=True, text=True).stdout
    assert children == ""


def test_a_summary_adds_points():
    found = [Told("a", 1.5, 2.0, False, ""), Told("b", 3.0, 3.0, True, "")]
    assert summary(found) == "1 of 2 parts are right: 4.5 of 5 points"
