"""A recorded part gives what the part gives, and the log has what its methods got and gave."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.explain.log import Log
from taichi_tracer.explain.recorded import NotedMethod, given_names, recorded


@ti.data_oriented
class Part:
    """A part with a method that calls another one."""

    @ti.func
    def pair(self, x, y):
        return x + y, tm.vec2(x, y)

    @ti.func
    def outer(self, x):
        total, _ = self.pair(x, 1.0)
        return total


@ti.kernel
def ask(part: ti.template(), log: ti.template(), is_on: ti.i32) -> float:
    log.is_on[None] = is_on
    return part.outer(3.0)


FORMS = {
    "outer": NotedMethod("the outer one", got=("x",), gave=("total",), is_group=True),
    "pair": NotedMethod(got=("y",), gave=("total", "both"), is_limited=True),
    "absent": NotedMethod(),
}

pytestmark = pytest.mark.usefixtures("f32")


def test_steps_within_a_group_stand_between_its_beginning_and_its_end():
    log, part = Log(), Part()
    watched = recorded(part, log, FORMS)
    assert ask(watched, log, 1) == ask(part, log, 0) == 4
    found, counts = log.read()
    assert [(entry.name, entry.mark) for entry, _ in found] == [
        ("the outer one", "begin"),
        ("pair", ""),
        ("the outer one", "end"),
    ]
    begin, inner, end = (values for _, values in found)
    assert begin == {"x": 3}
    assert (inner["y"], inner["total"], inner["both"].tolist()) == (1, 4, [3, 1])
    assert end == {"total": 4}
    assert counts == {"pair": 1}


def test_results_get_their_names_in_order():
    assert given_names(("w_i", "pdf"), (1, 2, 3)) == {"w_i": 1, "pdf": 2}
    assert given_names(("value",), 5) == {"value": 5}
    assert given_names(("value",), (5, 6)) == {"value": 5}
    assert given_names((), 5) == given_names(("value",), None) == {}


def test_places_and_the_triangles_in_them_are_noted():
    """With the ids that the triangles have there."""
    transforms = np.tile(np.eye(4), (3, 1, 1))
    transforms[:, 0, 3] = -5, 0, 5
    transforms[1] = np.diag([-1.0, 1, 1, 1])
    mesh = tt.group([tt.Instances(tt.load_mesh("cube"), transforms)])
    renderer = tt.A1Renderer(tt.scene_from_mesh(mesh, instances="shared"), 33, 33).use("normal").render()
    found = renderer.explain(16, 16)
    assert [step.values["place"] for step in found.find("a place is entered")].count(1) == 1
    tried = found.find("a triangle is tried")
    assert {12 <= step.values["triangle_id"] < 24 for step in tried} == {True}
    corners = found.triangles[0]
    assert (abs(corners[:, 0]) <= 1).all()
