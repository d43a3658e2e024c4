"""Can a window be opened here? This has to be known before, because ``ti.ui`` ends the process where none can."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import taichi as ti

from taichi_tracer.system import runtime

# This opens a small window for one frame. It is a visible one, since Taichi makes no surface for a hidden one.
TRIAL = """
import taichi as ti
ti.init(arch=ti.cpu, log_level=ti.ERROR)
window = ti.ui.Window("taichi_tracer tries a window", (64, 64))
window.get_canvas().set_background_color((0, 0, 0))
window.show()
print("opened")
"""
TRIAL_SECONDS = 20.0  # a window that takes longer to open is of no use


@dataclass(frozen=True)
class WindowVerdict:
    """Whether a window can be opened.

    Attributes:
        reason: why it can or cannot. remedy: what would mend it; "" where nothing needs to be mended.
    """

    can_open: bool
    reason: str
    remedy: str = ""


def can_open_window() -> WindowVerdict:
    """Whether ``ti.ui.Window`` will open: facts answer where they suffice, else a child process tries it."""
    if not ti._lib.core.GGUI_AVAILABLE:
        return WindowVerdict(False, "this build of Taichi has no windows", "pip install --force-reinstall taichi")
    display = find_display()
    if not display.can_open:
        return display
    devices = runtime.vulkan_devices()
    if sys.platform != "darwin" and len(devices) == 0:
        return WindowVerdict(False, "no Vulkan driver was found", vulkan_remedy())
    if is_certain():
        return WindowVerdict(True, f"{display.reason}; Vulkan on {devices[0].name}")
    return try_in_child()


def is_certain() -> bool:
    """Whether a display and a Vulkan device prove that a window will open.

    Over a network they do not, nor where Metal takes part, nor where another user's X server may refuse this one.
    """
    name = os.environ.get("DISPLAY", "")
    if not sys.platform.startswith("linux"):
        return sys.platform != "darwin" and "SSH_CONNECTION" not in os.environ
    return "SSH_CONNECTION" not in os.environ and is_local(name) and socket_of(name).stat().st_uid == os.getuid()


def find_display() -> WindowVerdict:
    """Whether there is a screen to open a window on."""
    if not sys.platform.startswith("linux"):
        return WindowVerdict(True, "the desktop")
    name = os.environ.get("DISPLAY", "")
    if name == "":
        if os.environ.get("WAYLAND_DISPLAY", "") != "":
            return WindowVerdict(
                False, "Wayland without X11, which Taichi's windows need", "install and start xwayland"
            )
        remedy = "run it on a desktop, or with: xvfb-run -s '-screen 0 1280x1024x24'"
        return WindowVerdict(False, "no display (DISPLAY is not set)", remedy)
    if is_local(name) and not socket_of(name).exists():
        return WindowVerdict(False, f"the display {name!r} cannot be opened", "check DISPLAY, or `xhost` and `ssh -X`")
    return WindowVerdict(True, f"display {name}")


def is_local(name: str) -> bool:
    """Whether an X server runs on this machine."""
    return name.startswith((":", "unix:"))


def socket_of(name: str) -> Path:
    """The socket of a local X server, whose owner runs it."""
    return Path("/tmp/.X11-unix", f"X{name.rpartition(':')[2].partition('.')[0]}")


def vulkan_remedy() -> str:
    """What to install for a Vulkan driver."""
    if sys.platform.startswith("linux"):
        return "sudo apt install libvulkan1 mesa-vulkan-drivers (or the driver of your graphics card)"
    return "install the newest driver of your graphics card"


def try_in_child() -> WindowVerdict:
    """Open a window in another process, which may die of it."""
    environment = {**os.environ, "TI_SKIP_VERSION_CHECK": "ON", "ENABLE_TAICHI_HEADER_PRINT": "0"}
    try:
        child = subprocess.run(
            [sys.executable, "-c", TRIAL], env=environment, capture_output=True, text=True, timeout=TRIAL_SECONDS
        )
    except subprocess.TimeoutExpired:
        return WindowVerdict(False, f"a trial window did not open within {TRIAL_SECONDS:g} s", vulkan_remedy())
    if "opened" in child.stdout:
        return WindowVerdict(True, "a trial window opened")
    last = (child.stderr.strip().splitlines() or ["no message"])[-1]
    return WindowVerdict(False, f"a trial window failed: {last}", vulkan_remedy())
