"""A window under a virtual display: how tests start a program there, look at it, and use its keys and its mouse."""

import contextlib
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import ImageGrab, features

import taichi_tracer as tt
from taichi_tracer.apps import viewer
from taichi_tracer.system import runtime

TIME_OUT = 180.0  # seconds; on a busy machine the window takes long to compile its kernels
GEOMETRY = ("X", "Y", "WIDTH", "HEIGHT")


def why_no_window() -> str:
    """What is missing for a window under a virtual display; empty where nothing is."""
    if not sys.platform.startswith("linux"):
        return "virtual displays are an X11 thing"
    missing = [program for program in ("Xvfb", "xdotool") if shutil.which(program) is None]
    if not runtime.vulkan_devices():
        missing.append("a Vulkan driver (mesa-vulkan-drivers)")
    if not features.check("xcb"):
        missing.append("Pillow with xcb")
    return f"missing: {', '.join(missing)}" if missing else ""


class Desktop:
    """A virtual display with a program's window on it."""

    def __init__(self, name, process, log):
        self.name, self.process, self.log = name, process, log
        self.id = poll(self.found, "the window")[0]
        self.measure()

    def found(self):
        """The ids of windows with the viewer's title; it fails if the program has ended."""
        if self.process.poll() is not None:
            pytest.fail(f"the program ended with {self.process.returncode}: {self.log.read_text()}")
        return self.xdotool("search", "--name", f"^{viewer.TITLE}$").split()

    def measure(self):
        """Ask where the window is, and how large."""
        where = self.xdotool("getwindowgeometry", "--shell", self.id)
        self.x, self.y, self.width, self.height = (int(re.search(rf"{n}=(\d+)", where)[1]) for n in GEOMETRY)

    def xdotool(self, *words):
        """Run xdotool; returns what it prints."""
        environment = {**os.environ, "DISPLAY": self.name}
        return subprocess.run(["xdotool", *words], env=environment, capture_output=True, text=True, timeout=20).stdout

    def window(self):
        """(h, w, 3) pixels of the window."""
        box = (self.x, self.y, self.x + self.width, self.y + self.height)
        return np.asarray(ImageGrab.grab(bbox=box, xdisplay=self.name).convert("RGB")).astype(int)

    def point(self, x, y):
        """Move the mouse to a point of the window."""
        self.xdotool("mousemove", str(self.x + x), str(self.y + y))


def poll(question, what):
    """The first true answer; fails when none comes in time."""
    deadline = time.monotonic() + TIME_OUT
    while time.monotonic() < deadline:
        answer = question()
        if answer:
            return answer
        time.sleep(0.05)
    pytest.fail(f"{what} did not appear within {TIME_OUT:g} s")


@contextlib.contextmanager
def opened(words, folder: Path, kind=Desktop, screen="1024x768x24"):
    """A Python program on a display of its own, as a ``kind``; both end with the block.

    Args:
        words: what follows ``python``. folder: where it runs; its output goes into the file "log" there.
    """
    if why_no_window():
        pytest.skip(why_no_window())
    log = folder / "log"
    command = ["Xvfb", "-displayfd", "1", "-noreset", "-screen", "0", screen]  # it stays as one client follows another
    display = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    name = f":{display.stdout.readline().strip()}"
    package = Path(tt.__file__).parents[1]
    environment = {**os.environ, "DISPLAY": name, "PYTHONPATH": f"{package}{os.pathsep}{os.environ.get('PYTHONPATH')}"}
    with log.open("w") as output:
        process = subprocess.Popen(
            [sys.executable, *words], cwd=folder, env=environment, stdout=output, stderr=subprocess.STDOUT
        )
    try:
        yield kind(name, process, log)
    finally:
        process.kill()
        process.wait()
        display.terminate()
        display.wait()
