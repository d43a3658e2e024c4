"""Without a screen on this machine, it is said what is missing, and nothing ends the process."""

import sys

import pytest

from taichi_tracer.apps import display

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="X11 is asked on Linux only")


@pytest.mark.parametrize(
    ("name", "reason", "remedy"),
    [("", "DISPLAY is not set", "xvfb-run"), ("localhost:4711.0", "not on this machine", "--browser")],
)
def test_without_a_display(monkeypatch, name, reason, remedy):
    monkeypatch.setenv("DISPLAY", name)
    found, mends = display.missing_for_window()
    assert reason in found
    assert remedy in mends
