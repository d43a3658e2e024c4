"""What works on this machine, and what would mend the rest."""

import importlib.metadata
import importlib.util
import platform
import sys
from argparse import Namespace
from collections.abc import Iterator

import taichi_tracer
from taichi_tracer.apps.console import Parser
from taichi_tracer.apps.viewer import missing_for_window
from taichi_tracer.system import runtime
from taichi_tracer.system.runtime import cache_folder, wanted_folder
from taichi_tracer.teaching.grading import isolate

PACKAGES = ("taichi", "numpy", "trimesh", "Pillow", "tqdm", "matplotlib", "flip-evaluator", "mapbox-earcut")
# Modules that the package does not depend on: module → (what it is for, the extra that installs it)
EXTRAS = {
    "OpenImageIO": ("pictures .exr and .hdr", "exr"),
    "ipykernel": ("notebooks", "notebook"),
    "pytest": ("the tests", "test"),
}
NAME_WIDTH, FOUND_WIDTH = 20, 48
Fact = tuple[str, str, bool, str]  # what was looked at, what was found, whether this is well, what would mend it


def add_arguments(parser: Parser) -> None:
    """Add nothing: ``doctor`` takes no arguments."""


def run(_: Namespace) -> int:
    """Print every fact as it is found."""
    for name, found, is_ok, remedy in examine():
        print(f"{name:<{NAME_WIDTH}}{found:<{FOUND_WIDTH}} {'ok' if is_ok else 'missing'}", flush=True)
        if not is_ok:
            print(f"{'':<{NAME_WIDTH}}-> {remedy}", flush=True)
    return 0


def examine() -> Iterator[Fact]:
    """Every fact about this machine."""
    yield "taichi_tracer", taichi_tracer.__version__, True, ""
    yield "Python", f"{platform.python_version()} on {platform.system()} {platform.machine()}", True, ""
    for package in PACKAGES:
        yield package, importlib.metadata.version(package), True, ""
    for arch in ("metal",) if sys.platform == "darwin" else ("cuda", "vulkan"):
        has = runtime.has_device(arch)
        found = "has a device" if has else "no GPU answers"
        yield f"backend {arch}", found, has, "optional, the CPU does everything: a GPU and its driver"
    yield "backend chosen", runtime.ensure().arch, True, ""
    unused = runtime.patches()
    yield "patches of Taichi", unused or "in use", unused == "", "all works without them, slower"
    reason, remedy = missing_for_window() or ("can open", "")
    yield "window", reason, remedy == "", remedy
    for module, (purpose, extra) in EXTRAS.items():
        has = importlib.util.find_spec(module) is not None
        yield module, f"for {purpose}", has, f"pip install 'taichi_tracer[{extra}]'"
    wanted = wanted_folder()
    folder, problem = cache_folder(wanted)
    remedy = f"make {wanted} writable for you, or set XDG_CACHE_HOME to a folder that is"
    yield "kernel cache", problem or f"{folder}: can be written; may be deleted", problem is None, remedy
    levels = [level for level in isolate.LEVELS if isolate.problem_of(level) is None]  # each is tried with a process
    remedy = "docs/teaching_security.md says what each level needs and stops"
    yield "isolation of grade", "; ".join(levels) or "none works here", "bwrap" in levels, remedy
