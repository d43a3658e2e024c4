"""The probe for a window: every way in which none can open is told apart, and nothing of it ends the process."""

import sys

import pytest

from taichi_tracer.apps import display

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="X11 is asked on Linux only")


@linux
def test_without_a_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    verdict = display.can_open_window()
    assert not verdict.can_open
    assert "DISPLAY is not set" in verdict.reason
    assert "xvfb-run" in verdict.remedy


@linux
def test_a_trial_that_kills_its_process_is_survived(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    verdict = display.try_in_child()
    assert not verdict.can_open
    assert "a trial window failed: " in verdict.reason
