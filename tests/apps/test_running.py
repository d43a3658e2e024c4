"""Signals: at once where nothing is lost, after the picture is kept elsewhere."""

import signal
import sys

import pytest

from taichi_tracer.apps import running
from taichi_tracer.apps.running import SIGNALS, Interruption, WhileCompiling

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are sent by kill")


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
    monkeypatch.setattr(running, "leave", numbers.append)
    monkeypatch.setattr(signal, "getsignal", lambda number: signal.SIG_DFL)  # which may be ignored, as in CI
    return numbers


class Slow:
    """A kernel that was read for long, so that its translation may take seconds."""

    reading, name = 1.0, "slow"


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
