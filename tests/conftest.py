"""Taichi in each precision, and random numbers."""

import os
import zlib

import numpy as np
import pytest
from support import start

from taichi_tracer.fast.kept_forms import KEPT
from taichi_tracer.system import runtime
from taichi_tracer.system.registry import PARTS


@pytest.fixture(scope="module")
def f32():
    """Taichi in f32."""
    start("f32")


@pytest.fixture(scope="module", params=["f32", pytest.param("f64", marks=pytest.mark.exhaustive)])
def precision(request):
    """Taichi in each precision; its name."""
    start(request.param)
    return request.param


@pytest.fixture(scope="session", autouse=True)
def forms_of_no_other_process():
    """What other processes compiled on this machine does not choose the forms of the tests' pictures."""
    KEPT._known, KEPT.path = {}, lambda: None


@pytest.fixture(scope="module", autouse=True)
def single_precision_afterwards():
    """A file that names no precision has f32, whichever file ran before it."""
    yield
    if (settings := runtime.current()) and settings.precision != "f32":
        start("f32")


@pytest.fixture(scope="module", autouse=True)
def own_parts():
    """What a test file registers, and its modules load, is no part of the tests of other files."""
    before = [*PARTS.everything()]
    yield
    for part in PARTS.everything():
        if not PARTS.comes_with_package(part) and not any(part is one for one in before):
            PARTS.remove(part)


@pytest.fixture
def rng():
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20)


FRACTION = 40  # one of so many parts of the tests that nothing else runs


def pytest_collection_modifyitems(config, items):
    """Skip the tests that are marked long or exhaustive, unless TAICHI_TRACER_LONG asks for them.

    A test is long if it takes seconds and repeats what shorter tests check: by the command line, on more scenes or with
    more samples. TAICHI_TRACER_LONG=1 runs the first case of each long test, as .ci/run does. A test is exhaustive if
    it repeats what long tests check, with everything that the package has. TAICHI_TRACER_LONG=all runs every case of
    every test. The number of a commit, in hexadecimal digits after "part-", runs nothing but a fortieth of what is
    left: another one for most commits. TAICHI_TRACER_QUARTER, with such a number, runs a quarter of the files: another
    one for most commits.
    """
    if quarter := os.environ.get("TAICHI_TRACER_QUARTER"):
        files = {item: zlib.crc32(item.path.relative_to(config.rootpath).as_posix().encode()) for item in items}
        chosen = [item for item in items if (files[item] + int(quarter, 16)) % 4 == 0]
        config.hook.pytest_deselected(items=[item for item in items if item not in set(chosen)])
        items[:] = chosen
    asked = os.environ.get("TAICHI_TRACER_LONG") or ""
    begun, left = set(), []
    for item in items:
        marks = {mark.name for mark in item.iter_markers()}
        test = item.path, item.originalname
        if "exhaustive" in marks or ("long" in marks and test in begun):
            left.append(item)
            needed = "all"
        else:
            needed = "1" if "long" in marks else ""
        if needed and asked not in (needed, "all"):
            mark = "exhaustive" if "exhaustive" in marks else "long"
            if not asked.startswith("part-"):
                item.add_marker(pytest.mark.skip(reason=f"{mark}: TAICHI_TRACER_LONG={needed} runs it"))
        if "long" in marks:
            begun.add(test)
    if asked.startswith("part-"):
        part = int(asked.removeprefix("part-"), 16) % FRACTION
        chosen = [item for item in left if zlib.crc32(item.nodeid.encode()) % FRACTION == part]
        config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
        items[:] = chosen
