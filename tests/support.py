"""How tests start Taichi and find real meshes.

TAICHI_TRACER_DEBUG=1 checks the bounds of every read (slow); TAICHI_TRACER_TESTS_ARCH=vulkan takes another backend.
"""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from taichi_tracer.system import memory, runtime

ARCH = os.environ.get("TAICHI_TRACER_TESTS_ARCH", "cpu")  # of contract tests and of the course's scripts
DEBUG = os.environ.get("TAICHI_TRACER_DEBUG") == "1"
DATA = Path(__file__).parent.parent.parent / "shared" / "data"


def start(precision: str = "f32", **options) -> None:
    """Taichi on the CPU, or on ``ARCH``, in a precision, whatever ran before."""
    if precision == "f64" and ARCH not in runtime.F64_ARCHS:
        pytest.skip(f"{ARCH} has no f64")
    wanted = runtime.Settings(ARCH, precision, options.get("fast_math", False))
    if runtime.current() != wanted or options:
        runtime.init(ARCH, precision, force=True, debug=DEBUG, **options)


def data_file(name: str) -> Path:
    """A real mesh from beside the checkout; the test is skipped where there is none."""
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    return path


def needs_patches() -> None:
    """Skip the test where the patches of ``taichi_17`` are not in use."""
    if reason := runtime.patches():
        pytest.skip(f"no patches: {reason}")


def needs_arrays() -> None:
    """Skip the test where fields are Taichi's own, and not in numpy's memory."""
    needs_patches()
    if not memory.arrays_are_possible():
        pytest.skip("fields are Taichi's own on a GPU and in debug mode")


@contextlib.contextmanager
def without_arrays() -> Iterator[None]:
    """The fields of each ``Memory`` that is made within this context are Taichi's own."""
    with pytest.MonkeyPatch.context() as undo:
        undo.setattr(memory, "arrays_are_possible", lambda: False)
        yield
