"""The table of what is replaced: nothing at an import, only what fits, only what is wanted, and no picture changes."""

import pytest
from wings import copy_without, printed, run

from taichi_tracer.system.errors import InputError
from taichi_tracer.system.taichi_17 import patches
from taichi_tracer.system.taichi_17.patches import NAMES, PATCHES, Patch

FITS = {"taichi.lang.impl:expr_init": ("rhs", "powers:of_a_value")}


# ── which are wanted


@pytest.mark.parametrize(
    ("text", "names"),
    [("", NAMES), ("all", NAMES), ("none", ()), ("powers", ("powers",)), (" advice , powers,", ("advice", "powers"))],
)
def test_the_switch(text, names):
    assert patches.wanted(text) == names


def test_an_unknown_name_is_one_clear_line():
    with pytest.raises(InputError, match=r"^unknown patch in TAICHI_TRACER_PATCHES 'power': did you mean 'powers'\?"):
        patches.wanted("advice,power")


# ── which fit


@pytest.mark.parametrize("patch", PATCHES, ids=NAMES)
def test_every_patch_fits_the_taichi_that_is_installed(patch, monkeypatch):
    """Its parameters are those of Taichi's own names, also where another patch has replaced them."""
    assert patches.why_not(patch) == ""


@pytest.mark.parametrize(
    ("patch", "reason"),
    [
        (
            Patch("a", "", {"taichi.lang.impl:expr_inits": FITS["taichi.lang.impl:expr_init"]}),
            "no attribute 'expr_init",
        ),
        (
            Patch("a", "", {"taichi.lang.no_such:name": ("x", "powers:of_a_value")}),
            "No module named 'taichi.lang.no_su",
        ),
        (
            Patch("a", "", {"taichi.lang.impl:expr_init": ("x y", "powers:of_a_value")}),
            "has the parameters (rhs), not (x",
        ),
        (Patch("a", "", FITS, needs=("taichi:no_such_function",)), "no attribute 'no_such_function'"),
    ],
)
def test_what_does_not_fit_is_told(patch, reason):
    assert reason in patches.why_not(patch)
    assert patches.why_not(Patch("a", "", FITS)) == ""


def test_another_version_is_left_alone(monkeypatch):
    monkeypatch.setattr(patches.ti, "__version__", (1, 8, 0))
    assert {patches.why_not(patch) for patch in PATCHES} == {"Taichi 1.8.0 was not tried"}


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


def test_a_wrong_switch_is_one_line_of_the_command(tmp_path):
    program = "import sys; from taichi_tracer.__main__ import main; sys.argv[1:] = ['info', 'cube']; sys.exit(main())"
    done = run(copy_without(tmp_path), program, TAICHI_TRACER_PATCHES="blockz")
    assert done.returncode == 2
    assert "unknown patch in TAICHI_TRACER_PATCHES 'blockz': did you mean 'blocks'?" in done.stderr
    assert "Traceback" not in done.stderr
