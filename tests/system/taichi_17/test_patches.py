"""The table of what is replaced: nothing at an import, only what fits, only what is wanted, and no picture changes."""

import pytest
from wings import copy_without, printed

from taichi_tracer.system.taichi_17 import patches
from taichi_tracer.system.taichi_17.patches import NAMES, PATCHES

# ── which are wanted


# ── which fit


@pytest.mark.parametrize("patch", PATCHES, ids=NAMES)
def test_every_patch_fits_the_taichi_that_is_installed(patch, monkeypatch):
    """Its parameters are those of Taichi's own names, also where another patch has replaced them."""
    assert patches.why_not(patch) == ""


# ── when they are replaced

NAMES_BEFORE_INIT = """
import importlib, inspect, pkgutil, sys
import taichi, taichi.math
from taichi_tracer.system.taichi_17.patches import PATCHES, place_of
names = {name for patch in PATCHES for name in patch.replaces}
def found():
    return {name: inspect.getattr_static(*place_of(name)) for name in names}
before, of_python = found(), inspect.getframeinfo
import taichi_tracer as tt
for name in dir(tt):
    getattr(tt, name)
for module in pkgutil.walk_packages(tt.__path__, "taichi_tracer."):
    if module.name.split(".")[1] in ("fast", "formulas", "system", "picture", "integrators", "lights"):
        importlib.import_module(module.name)
print([name for name in names if found()[name] is not before[name]], inspect.getframeinfo is of_python)
tt.init("cpu")
print([name for name in names if found()[name] is before[name]])
"""


def test_an_import_replaces_nothing_and_init_does(tmp_path):
    imported, started = printed(copy_without(tmp_path), NAMES_BEFORE_INIT, TAICHI_TRACER_PATCHES="").splitlines()
    assert (imported, started) == ("[] True", "[]")


# ── what they change
