"""An observed part does what the part does, whatever was replaced, and its observer sees every call."""

import ast
from pathlib import Path

import pytest
import taichi as ti

import taichi_tracer
from taichi_tracer.system.parts import call_with_known_args

pytestmark = pytest.mark.usefixtures("f32")


@ti.kernel
def ask(part: ti.template(), number: ti.i32) -> ti.i32:
    return call_with_known_args(part.scaled, number, plus=1)


def test_samples_begin_in_one_place():
    """One loop begins the samples of pictures: whoever watches a sample uses this loop.

    The checks of the assignments and of parts ask for random numbers, too, but make no picture; ``course`` counts
    samples of an environment; and ``unseen`` compares two techniques in a few pixels.
    """
    package = Path(taichi_tracer.__file__).parent
    found = set()
    for path in package.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call)]
        if any(getattr(call.func, "attr", "") == "start" and len(call.args) == 4 for call in calls):
            found.add(path.relative_to(package).parts[0])
    assert found == {"progressive.py", "teaching", "contracts", "course", "unseen"}
