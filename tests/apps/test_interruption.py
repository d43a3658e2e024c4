"""Signals: at once where nothing is lost, after the picture is kept elsewhere, and nothing half done is left behind."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import taichi_tracer as tt
from taichi_tracer.apps import cli, interruption
from taichi_tracer.apps.interruption import SIGNALS, Interruption, WhileCompiling
from taichi_tracer.files.disk import make_folder
from taichi_tracer.studies import hard_cases
from taichi_tracer.system import leftovers

PACKAGE = Path(tt.__file__).parents[1]
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are sent by kill")

SWALLOWED = """
import os, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from taichi_tracer.apps.interruption import leave_at_once
leave_at_once()
from taichi_tracer.files.disk import make_folder
from taichi_tracer.system import leftovers
make_folder("a/b", "test")
open("half", "w").close()
leftovers.unfinished.add("half")
print("printed")
try:
    os.kill(os.getpid(), signal.{name})
except BaseException:
    pass
print("swallowed")
"""


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_no_signal_is_swallowed_before_there_is_something_to_keep(name, code, tmp_path):
    program, env = SWALLOWED.format(name=name), os.environ | {"PYTHONPATH": str(PACKAGE)}
    child = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=env, capture_output=True, text=True)
    assert (child.returncode, child.stdout) == (code, "printed\n")
    assert child.stderr == f"taichi-tracer: {SIGNALS[signal.Signals[name]]}\n"
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(autouse=True)
def heard():
    """Signals that are ignored where the tests run in the background do what they do elsewhere."""
    usual = {number: signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL for number in SIGNALS}
    before = {number: signal.signal(number, handler) for number, handler in usual.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def left(monkeypatch):
    """The signals by which the process would have ended."""
    numbers = []
    monkeypatch.setattr(interruption, "leave", numbers.append)
    monkeypatch.setattr(signal, "getsignal", lambda number: signal.SIG_DFL)  # which may be ignored, as in CI
    return numbers


@pytest.mark.parametrize("number", SIGNALS)
def test_a_quick_second_signal_asks_for_nothing_new(number, left, monkeypatch):
    before = signal.signal(number, signal.SIG_IGN)
    monkeypatch.setattr(interruption, "SAME", float("inf"))
    with Interruption() as caught:
        caught.is_rendering = True
        for _ in range(3):
            os.kill(os.getpid(), number)
    assert (caught.number, caught.exit_code, left) == (number, 128 + number, [])
    assert signal.signal(number, before) is signal.SIG_IGN


def test_a_later_one_ends_a_long_sample_and_then_the_process(left, monkeypatch):
    monkeypatch.setattr(interruption, "SAME", -1.0)
    with Interruption() as caught:
        os.kill(os.getpid(), signal.SIGINT)
        caught.is_rendering = True
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        caught.is_rendering = False
        os.kill(os.getpid(), signal.SIGTERM)
    assert left == [signal.SIGTERM]
    assert caught.word == "interrupted"


def test_an_interrupted_report_leaves_no_empty_folder(tmp_path, monkeypatch, capsys):
    def interrupted(*args, **options):
        assert (tmp_path / "new" / "report").is_dir()
        raise KeyboardInterrupt

    monkeypatch.setattr(hard_cases, "run", interrupted)
    assert cli.main(["hardcases", "--quick", "--report", str(tmp_path / "new" / "report")]) == 130
    assert capsys.readouterr().err.endswith("taichi-tracer: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_folders_that_were_there_or_hold_something_stay(tmp_path):
    (tmp_path / "old").mkdir()
    for name in ("old", "old/full", "old/empty"):
        make_folder(tmp_path / name, "test")
    (tmp_path / "old" / "full" / "a").touch()
    leftovers.remove()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "full", "old"]


class Slow:
    """A kernel that was read for long, so that its translation may take seconds."""

    reading, name = 1.0, "slow"


def test_while_a_kernel_is_compiled_the_system_ends_the_process(tmp_path):
    before = signal.signal(signal.SIGINT, interruption.leave)
    try:
        watcher = WhileCompiling()
        make_folder(tmp_path / "new", "test")
        watcher.begins(Slow())
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
        assert not (tmp_path / "new").exists()
        watcher.ends()
        assert signal.getsignal(signal.SIGINT) is interruption.leave
        assert (tmp_path / "new").exists()
    finally:
        signal.signal(signal.SIGINT, before)
        leftovers.remove()


def test_before_that_the_picture_so_far_is_kept():
    kept = []
    with Interruption() as caught:
        watcher = WhileCompiling()
        watcher.begins(Slow())
        assert signal.getsignal(signal.SIGINT) == caught._note  # something has come, and nobody can keep it
        watcher.ends()
        caught.keep = lambda: kept.append(True)
        watcher.begins(Slow())
        assert (signal.getsignal(signal.SIGINT), kept) == (signal.SIG_DFL, [True])
        watcher.ends()
        assert signal.getsignal(signal.SIGINT) == caught._note


def test_what_is_kept_may_compile_a_kernel_itself():
    kept = []
    with Interruption() as caught:
        watcher = WhileCompiling()

        def keep():
            kept.append(True)
            watcher.begins(Slow())
            assert signal.getsignal(signal.SIGINT) == caught._note
            watcher.ends()

        caught.keep = keep
        for _ in range(2):
            watcher.begins(Slow())
            assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
            watcher.ends()
        assert kept == [True, True]


def test_a_signal_that_came_before_a_kernel_is_compiled_ends_the_rendering():
    with Interruption() as caught:
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            WhileCompiling().begins(Slow())
    assert caught.number == signal.SIGINT


def test_where_nothing_has_come_a_signal_ends_the_process_at_once(left):
    with Interruption(has_come=lambda: False):
        os.kill(os.getpid(), signal.SIGTERM)
    assert left == [signal.SIGTERM]


def test_a_signal_that_came_earlier_ends_the_process_before_a_kernel_is_compiled_if_nothing_has_come(left):
    with Interruption() as caught:
        os.kill(os.getpid(), signal.SIGINT)
        caught.has_come = lambda: False
        assert caught.lets_go()
    assert left == [signal.SIGINT]
