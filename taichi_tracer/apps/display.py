"""What is missing for a window, which has to be known before: ``ti.ui`` ends the process where none can open."""

import os
import sys
from pathlib import Path

import taichi as ti

from taichi_tracer.system import runtime


def missing_for_window() -> tuple[str, str] | None:
    """What is missing, and what would mend it; None where a window can open."""
    if not ti._lib.core.GGUI_AVAILABLE:
        return "this build of Taichi has no windows", "pip install --force-reinstall taichi"
    if sys.platform.startswith("linux"):
        name = os.environ.get("DISPLAY", "")
        if name == "":
            remedy = "run it on a desktop, or with: xvfb-run -s '-screen 0 1280x1024x24'"
            return "no display (DISPLAY is not set)", remedy
        socket = Path("/tmp/.X11-unix", f"X{name.rpartition(':')[2].partition('.')[0]}")  # /tmp/.X11-unix/X1 of ":1.0"
        if not socket.exists():
            return f"the display {name!r} is not on this machine", "view --browser serves the picture to a browser"
    if sys.platform != "darwin" and not runtime.vulkan_devices():
        remedy = "install the driver of your graphics card, or on Linux: sudo apt install mesa-vulkan-drivers"
        return "no Vulkan driver was found", remedy
    return None
