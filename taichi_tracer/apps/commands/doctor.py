"""What works on this machine, and what would mend the rest."""

import importlib.metadata
import importlib.util
import os
import platform
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import taichi as ti

import taichi_tracer
from taichi_tracer.apps import display
from taichi_tracer.apps.grammar import Parser
from taichi_tracer.files.images import ENCODERS, save_image
from taichi_tracer.system import runtime
from taichi_tracer.system.cache import cache_folder, wanted_folder
from taichi_tracer.system.errors import InputError

VARIABLE = "TAICHI_TRACER_PATCHES"  # the environment variable that names the patches that are wanted
PACKAGES = ("taichi", "numpy", "trimesh", "Pillow", "tqdm", "matplotlib", "flip-evaluator", "mapbox-earcut")
# Modules that the package does not depend on: module → (what it is for, what installs it)
EXTRAS = {
    "ipykernel": ("notebooks", "pip install 'taichi_tracer[notebook]'"),
    "pytest": ("the tests", "pip install 'taichi_tracer[test]'"),
}
# The levels of isolation of submissions, and what makes each of them work.
ISOLATION = {
    "bwrap": "apt-get install bubblewrap; a container has to allow namespaces",
    "limits": "Linux, macOS, or Windows' subsystem for Linux",
}
MARKS_OF_CONTAINERS = ("/.dockerenv", "/run/.containerenv", "/autograder")
NAME_WIDTH, FOUND_WIDTH = 20, 48


@dataclass(frozen=True)
class Line:
    """One fact about the machine.

    Attributes:
        name: what was looked at. found: what was found.
        is_ok: whether nothing is missing there. remedy: what would mend it.
    """

    name: str
    found: str
    is_ok: bool = True
    remedy: str = ""

    def __str__(self) -> str:
        text = f"{self.name:<{NAME_WIDTH}}{self.found:<{FOUND_WIDTH}} {'ok' if self.is_ok else 'missing'}"
        return f"{text}\n{'':<{NAME_WIDTH}}-> {self.remedy}" if not self.is_ok and self.remedy else text


def add_arguments(parser: Parser) -> None:
    """Add nothing: ``doctor`` takes no arguments."""


def run(_: Namespace) -> int:
    """Print every fact as it is found."""
    for line in examine():
        print(line, flush=True)
    return 0


def examine() -> Iterator[Line]:
    """Every fact about this machine."""
    yield Line("taichi_tracer", taichi_tracer.__version__)
    yield Line("Python", f"{platform.python_version()} on {platform.system()} {platform.machine()}")
    for package in PACKAGES:
        yield package_line(package)
    yield from backend_lines()
    yield patches_line(runtime.patches())
    yield from window_lines()
    yield from image_lines()
    for module, (purpose, remedy) in EXTRAS.items():
        has = importlib.util.find_spec(module) is not None
        yield Line(module, f"for {purpose}", has, remedy)
    yield from cache_lines(wanted_folder())
    yield from isolation_lines()


def package_line(package: str) -> Line:
    """The installed version of something that the package needs."""
    try:
        return Line(package, importlib.metadata.version(package))
    except importlib.metadata.PackageNotFoundError:
        return Line(package, "not installed", False, f"{sys.executable} -m pip install {package}")


def backend_lines() -> Iterator[Line]:
    """Which backends have a device; a kernel is run on the one that is chosen."""
    for arch in ("metal",) if sys.platform == "darwin" else ("cuda", "vulkan"):
        has = runtime.has_device(arch)
        found = "has a device" if has else "no GPU answers"
        yield Line(f"backend {arch}", found, has, "optional, the CPU does everything: a GPU and its driver")
    start = time.perf_counter()
    settings = runtime.ensure()
    ti.field(float, shape=8).fill(1.0)
    ti.sync()
    yield Line("backend chosen", f"{settings.arch}; a first kernel took {time.perf_counter() - start:.2f} s")


def patches_line(patches: dict[str, str]) -> Line:
    """Which patches of Taichi are in use, and why others are not.

    Args:
        patches: what ``runtime.patches`` returns.
    """
    reasons = {name: reason for name, reason in patches.items() if reason}
    off = ", ".join(name for name, reason in reasons.items() if VARIABLE in reason)
    unfit = "; ".join(f"{name}: {reason}" for name, reason in reasons.items() if VARIABLE not in reason)
    found = f"{len(patches) - len(reasons)} of {len(patches)} in use" + (
        f"; {VARIABLE} leaves out {off}" if off else ""
    )
    remedy = f"all works without them, slower; Taichi 1.7.3 and 1.7.4 fit. {unfit}"
    return Line("patches of Taichi", found, not unfit, remedy)


def window_lines() -> Iterator[Line]:
    """Display, Vulkan devices, and whether a window can be opened."""
    screen = display.find_display()
    yield Line("display", screen.reason, screen.can_open, screen.remedy)
    devices = runtime.vulkan_devices()
    names = ", ".join(f"{d.name} ({'software' if d.is_software else 'hardware'})" for d in devices)
    yield Line("Vulkan devices", names or "none", len(devices) > 0, display.vulkan_remedy())
    verdict = display.can_open_window()
    yield Line("window", "can be opened" if verdict.can_open else "cannot", verdict.can_open, verdict.remedy)


def image_lines() -> Iterator[Line]:
    """Which picture formats can be written; each is tried with one pixel."""
    with tempfile.TemporaryDirectory() as folder:
        for extension in ENCODERS:
            try:
                save_image(Path(folder) / f"pixel{extension}", np.zeros((1, 1, 3)))
                yield Line(f"pictures {extension}", "can be written")
            except InputError as error:
                yield Line(f"pictures {extension}", "cannot be written", False, str(error))


def isolation_lines() -> Iterator[Line]:
    """Which isolation ``grade`` has for a submission; each is tried with a process that starts Taichi."""
    try:
        from taichi_tracer.teaching.grading import isolate
    except ModuleNotFoundError:
        yield Line("isolation of grade", "none: there is no taichi_tracer/teaching", False)
        return
    if os.name != "posix":
        yield Line(
            "isolation of grade", "none: submissions can be run on Linux and macOS only", False, ISOLATION["limits"]
        )
        return
    works = [level for level in isolate.candidates() if isolate.problem_of(level) is None]
    for name, remedy in ISOLATION.items():
        found = next((level for level in works if level.name == name), None)
        yield Line(f"isolation {name}", f"work ({found})" if found else "do not work here", found is not None, remedy)
    best = works[0] if works else None
    is_inside = any(Path(mark).exists() for mark in MARKS_OF_CONTAINERS)
    inside = "; this is a container" if is_inside else ""
    remedy = "docs/teaching_security.md says what the levels stop"
    trust = "; by --trust only" if best is not None and best.name == "limits" else ""
    yield Line("isolation of grade", f"{best}{trust}{inside}", best is not None and best.name != "limits", remedy)
    if best is not None:
        yield Line("not stopped there", isolate.NOT_STOPPED[best.name])


def cache_lines(wanted: Path) -> Iterator[Line]:
    """Where Taichi keeps compiled kernels, whether that can be written, how much is there, and what follows if not.

    Args:
        wanted: the folder that Taichi would choose.
    """
    folder, problem = cache_folder(wanted)
    remedy = f"make {wanted} writable for you"
    if os.name == "posix":
        remedy += ", or set XDG_CACHE_HOME to a folder that is"
    if folder is None:
        found = f"{wanted}: cannot be written; every run compiles all kernels again"
        yield Line("kernel cache", found, False, remedy)
        return
    files = [p for p in folder.rglob("*") if p.is_file()]
    size = f"{len(files)} files, {sum(p.stat().st_size for p in files) / 1e6:.1f} MB"
    yield Line("kernel cache", f"{folder}: can be written; {size}; may be deleted")
    if problem is not None:
        yield Line("wanted cache", problem, False, remedy)
