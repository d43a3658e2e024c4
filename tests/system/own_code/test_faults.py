"""Each mistake in a part is one line with its file and its line; the process goes on."""

import re
import warnings

import pytest
from wrong_parts import WRONG, view

import taichi_tracer as tt
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import OwnCodeError
from taichi_tracer.system.parts import PARTS, load_parts

pytestmark = pytest.mark.usefixtures("f32")
SLOTS = {"BRDF": "brdfs", "triangle test": "triangle_test", "intersector": "intersector"}


def run(path):
    """Load a file, and make a picture with what it registers."""
    (part,) = load_parts(str(path))
    try:
        chosen = {SLOTS[part.kind]: [part] if part.kind == "BRDF" else "mine"} if part.kind in SLOTS else {}
        scene = tt.load_scene_data("cube", **chosen, environment="studio" if part.kind == "BRDF" else None)
        camera = part(8, 8) if part.kind == "camera" else None
        if part.kind == "BRDF" or getattr(part, "what", "") == "estimator":
            tt.A2Renderer(scene, 8, 8).use("mine" if part.kind == "integrator" else "brdf").render()
        else:
            tt.A1Renderer(scene, 8, 8, camera=camera).use(part if part.kind == "integrator" else "normal").render()
    finally:
        PARTS.remove(part)


QUICK = sorted(WRONG)[::4]  # teaching/test_first_mistakes.py has others


@pytest.mark.parametrize("name", [one if one in QUICK else pytest.param(one, marks=pytest.mark.slow) for one in WRONG])
def test_a_mistake_is_told_in_one_line(name, tmp_path):
    text, told = WRONG[name]
    if runtime.patches() and ("# here" in text or name == "recursion"):
        pytest.skip("it is found while Taichi reads the kernel, by a patch that is not in use")
    path = tmp_path / "my_parts.py"
    path.write_text(text)
    here = [k for k, line in enumerate(text.splitlines(), 1) if line.endswith("# here")]
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always", UserWarning)
        if told.startswith("note: "):
            run(path)
            (message,) = [str(one.message) for one in noted if issubclass(one.category, UserWarning)]
        else:
            with pytest.raises(OwnCodeError) as error:
                run(path)
            message = str(error.value)
    assert re.search(told.removeprefix("note: "), message), message
    assert "\n" not in message
    line = re.match(rf"{re.escape(str(path))}:(\d+): ", message)
    assert line, message
    assert not here or int(line[1]) in here, message


SWITCH = """
def shade(kind, t):
    if kind == "near":
        return ti.select(t > 1, 0.0, t)
    return t
"""
RIGHT = (
    WRONG["no self"][0].replace("color(hit)", "color(self, hit)"),
    view("return tm.vec3(shade('near', hit.distance))", before=SWITCH),
)


@pytest.mark.parametrize("text", RIGHT)
def test_a_method_that_is_right_is_not_judged(text, tmp_path):
    path = tmp_path / "my_parts.py"
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        run(path)
