"""The probe for a window: every way in which none can open is told apart, and nothing of it ends the process."""

import sys

import pytest

from taichi_tracer.apps import display
from taichi_tracer.system import runtime

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="X11 is asked on Linux only")
SOFTWARE = [runtime.VulkanDevice("llvmpipe", True)]


@linux
def test_without_a_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    verdict = display.can_open_window()
    assert not verdict.can_open
    assert "DISPLAY is not set" in verdict.reason
    assert "xvfb-run" in verdict.remedy


@linux
def test_wayland_alone_is_not_enough(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    verdict = display.can_open_window()
    assert not verdict.can_open
    assert "xwayland" in verdict.remedy


@linux
def test_a_display_that_does_not_answer(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":9876")
    verdict = display.can_open_window()
    assert not verdict.can_open
    assert "':9876'" in verdict.reason


def test_without_vulkan(monkeypatch):
    monkeypatch.setattr(display.sys, "platform", "linux")
    monkeypatch.setattr(display, "find_display", lambda: display.WindowVerdict(True, "a display"))
    monkeypatch.setattr(runtime, "vulkan_devices", list)
    verdict = display.can_open_window()
    assert not verdict.can_open
    assert "Vulkan" in verdict.reason
    assert "mesa-vulkan-drivers" in verdict.remedy


def test_a_local_display_and_a_device_are_enough(monkeypatch):
    monkeypatch.setattr(display, "find_display", lambda: display.WindowVerdict(True, "display :0"))
    monkeypatch.setattr(runtime, "vulkan_devices", lambda: SOFTWARE)
    monkeypatch.setattr(display, "is_certain", lambda: True)
    monkeypatch.setattr(display, "try_in_child", lambda: pytest.fail("nothing was left to try"))
    assert display.can_open_window() == display.WindowVerdict(True, "display :0; Vulkan on llvmpipe")


@pytest.mark.parametrize(
    ("name", "ssh", "expected"),
    [(":0", "", True), ("unix:0", "", True), ("far:0", "", False), (":0", "1 2 3 4", False)],
)
def test_a_display_over_a_network_is_tried(name, ssh, expected, monkeypatch):
    monkeypatch.setattr(display.sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", name)
    monkeypatch.delenv("SSH_CONNECTION", raising=False)
    if ssh:
        monkeypatch.setenv("SSH_CONNECTION", ssh)
    assert display.is_certain() is expected


@linux
def test_a_trial_that_kills_its_process_is_survived(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    verdict = display.try_in_child()
    assert not verdict.can_open
    assert "a trial window failed: " in verdict.reason


def test_the_size_of_a_screen_that_cannot_be_asked_is_unknown(monkeypatch):
    monkeypatch.setattr(display.sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", ":9876")
    assert display.screen_size() is None
    monkeypatch.setattr(display.ctypes.util, "find_library", lambda _name: None)
    assert display.screen_size() is None


def test_a_trial_that_hangs_is_ended(monkeypatch):
    monkeypatch.setattr(display, "TRIAL", "import time; time.sleep(60)")
    monkeypatch.setattr(display, "TRIAL_SECONDS", 0.3)
    verdict = display.try_in_child()
    assert not verdict.can_open
    assert "within 0.3 s" in verdict.reason
