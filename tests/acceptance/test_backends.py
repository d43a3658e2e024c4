"""The same means on other backends, in f64, in debug mode, and after the user's own start of Taichi."""

import json

import pytest
from acceptance.command import process

CHILD = """
import json, sys, warnings
warnings.simplefilter("ignore")
arch, precision, mode = sys.argv[1:4]
import taichi as ti
if mode == "own":
    ti.init(arch=getattr(ti, arch), default_fp=getattr(ti, precision), fast_math=True, log_level=ti.ERROR)
import taichi_tracer as tt
if mode != "own":
    tt.init(arch, precision, debug=mode == "debug")
from acceptance import cases
maker, told = cases.Maker(is_quick=True), []
for case in sys.argv[4:]:
    try:
        told.append(cases.wrong(case, maker.blocks(case)))
    except Exception as error:
        told.append(f"{case}: {type(error).__name__}: {error}"[:400])
print(json.dumps([line for line in told if line]))
"""
FEW = ["A1 cornell_box normal", "A1 cornell_box distance", "A1 globe normal"]
FOREST = "A1 rt3/forest normal"  # a million leaves: Vulkan in software takes half a minute
LIGHT = ["A3 cube mis_balance", "A3 specular_spheres mis", "A4 white_room path", "RT3 rt3/all_lights blinn_phong"]


def wrong(folder, cases_asked, arch="cpu", precision="f32", mode=""):
    """What is wrong about the cases in a process of their own."""
    done = process("-c", CHILD, arch, precision, mode, *cases_asked, folder=folder)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_f64(tmp_path):
    assert wrong(tmp_path, [*FEW, FOREST, *LIGHT], precision="f64") == []


@pytest.mark.slow
def test_after_the_users_own_start(tmp_path):
    assert wrong(tmp_path, [*FEW, *LIGHT[:2]], mode="own") == []


@pytest.mark.slow
def test_debug_mode(tmp_path):
    assert wrong(tmp_path, ["A1 cornell_box normal", "A3 cube mis_balance", "A4 white_room path"], mode="debug") == []


@pytest.mark.slow
@pytest.mark.parametrize(("arch", "light"), [("cuda", [FOREST, *LIGHT]), ("vulkan", LIGHT[:1])])
def test_graphics_cards(tmp_path, arch, light):
    asked = f"import taichi as ti; ti.init(ti.{arch}); print(ti.cfg.arch == ti.{arch})"
    started = process("-c", asked, folder=tmp_path)
    if "True" not in started.stdout:
        pytest.skip(f"there is no {arch} here")
    assert wrong(tmp_path, [*FEW, *light], arch=arch) == []
