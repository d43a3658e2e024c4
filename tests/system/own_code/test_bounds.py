"""An index beyond a field is one line, in each kernel that reads it, and reads no foreign memory."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import needs_arrays, needs_patch

import taichi_tracer as tt
from taichi_tracer.system.errors import OwnCodeError
from taichi_tracer.system.own_code import bounds
from taichi_tracer.system.own_code.bounds import WATCH, Kept

pytestmark = pytest.mark.usefixtures("f32")
FAR = 100_000_000  # elements beyond: memory that the process does not have


@pytest.fixture(autouse=True)
def _nothing_is_kept(monkeypatch, tmp_path):
    needs_arrays()
    needs_patch("bounds")
    monkeypatch.setattr(WATCH, "kept", Kept())
    monkeypatch.setattr(bounds, "path_of_kept", lambda: tmp_path / "kept.json")


class Table(tt.View):
    """Shows an element of a table of 16 colours."""

    name, step = "table", 0

    def __init__(self):
        super().__init__()
        self.table = ti.Vector.field(3, float, shape=16)
        self.table.fill(0.5)

    @ti.func
    def color(self, hit):
        return self.table[hit.triangle_id + self.step]


class Ids(tt.RayIntersector):
    """Reads the corners of another triangle than the one that is asked for."""

    name, step, factor = "ids", 0, 1

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        ids = self.geometry.triangle_vertex_ids[triangle_id + self.step]
        v = ti.Matrix.rows([self.geometry.vertices[self.factor * ids[k]] for k in ti.static(range(3))])
        hit = tt.no_hit()
        if tm.dot(v[0, :], ray.direction) > 1e30:
            hit.is_hit = 1
        return hit


def line_of(text):
    """The line of this file that has a text."""
    with open(__file__) as file:
        return next(k for k, line in enumerate(file, 1) if text in line)


def picture(view):
    return tt.A1Renderer(tt.load_scene_data("cube"), 16, 16, integrator=view).render()


@pytest.mark.parametrize("step", [10, -9, FAR, -FAR])
def test_a_field_of_ones_own(step):
    view = Table()
    view.step = step
    at = rf"test_bounds.py:{line_of('return self.table[hit')}: index -?\d+ is beyond the field, .* 16 elements, 0 to 15"
    with pytest.raises(OwnCodeError, match=at):
        picture(view)


@pytest.mark.parametrize(("step", "factor"), [(1, 1), (0, FAR), (FAR, 1), (-1, 1)])
def test_the_arrays_of_a_mesh(step, factor):
    finder = type("Changed", (Ids,), {"step": step, "factor": factor})
    scene = tt.load_scene_data("cube", intersector=finder)
    text = "triangle_vertex_ids[triangle_id + self" if step else "self.geometry.vertices[self.factor"
    with pytest.raises(OwnCodeError, match=rf":{line_of(text)}: index -?\d+ is beyond the field"):
        scene.intersect(np.zeros((100, 3)), np.eye(3)[np.arange(100) % 3])
