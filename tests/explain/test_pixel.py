"""Explained pixels: the log of kernels, what observers note, and the samples that are computed once more."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import start

import taichi_tracer as tt
from taichi_tracer.explain.pixel import Log
from taichi_tracer.ray import Ray
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import InputError

# ── the log ──


@ti.data_oriented
class Noting:
    """Notes a few things in a loop."""

    def __init__(self):
        self.log = Log()

    @ti.kernel
    def run(self, n: ti.i32):
        ti.loop_config(serialize=True)
        for k in range(n):
            self.log.is_on[None] = ti.cast(k != 1, ti.i32)
            self.note(k, Ray(origin=tm.vec3(k, 0.1, -0.5), direction=tm.vec3(0, 0, 1)))

    @compile_time
    def note(self, k, ray):
        self.log.note("number", k=k, pair=(k + 1, tm.vec2(2, 3)))
        self.log.note("ray", "begin", ray=ray)
        self.log.note("often", is_limited=True, k=k)


@pytest.fixture(scope="module")
def noting():
    start("f32")
    return Noting()


def test_numbers_come_back_exact_and_in_order(noting):
    noting.log.clear()
    noting.run(3)
    found, counts = noting.log.read()
    assert [entry.name for entry, _ in found] == ["number", "ray", "often"] * 2  # nothing of k = 1
    assert [values["k"] for entry, values in found if entry.name == "number"] == [0, 2]
    _, values = found[4]
    assert values["ray.origin"].tolist() == [2, np.float64(np.float32(0.1)), -0.5]
    assert found[4][0].mark == "begin"
    assert found[3][1]["pair[0]"] == 3
    assert found[3][1]["pair[1]"].tolist() == [2, 3]
    assert counts == {"often": 2}


# ── observers ──


pytestmark = pytest.mark.usefixtures("f32")


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


def test_a_view_with_numbers_of_its_own_can_be_explained():
    renderer = tt.A1Renderer(tt.load_scene_data("cube"), 16, 16).use("distance").render()
    assert renderer.explain(8, 8).mean == pytest.approx(renderer.image()[8, 8])


# ── a pixel ──


SIZE = (24, 16)


@pytest.fixture(scope="module")
def cube():
    start("f32")
    return tt.load_scene_data("cube", environment="studio")


@pytest.fixture(scope="module")
def picture(cube):
    return tt.A2Renderer(cube, *SIZE).use("mis").render(5)


def one_that_hits(renderer):
    """The explanation of a sample that meets a surface."""
    rows, columns = np.nonzero(renderer.aov("material_id") >= 0)
    every = (renderer.explain(int(c), int(r)) for r, c in zip(rows, columns, strict=True))
    return next(found for found in every if found.find("query_segment")[0].values["is_hit"])


@pytest.mark.slow
def test_the_steps_have_the_handouts_names_and_order(picture):
    found = one_that_hits(picture)
    column, row = found.column, found.row
    names = [step.name for step in found.steps]
    wanted = ["random numbers", "generate_ray", "query_segment", "emitted", "surface", "reflected"]
    assert names == wanted
    camera = found.steps[1]
    assert [step.name for step in camera.steps] == ["generate_ndc_coords", "generate_camera_coords"]
    ndc = camera.steps[0].values["ndc"]
    xi = found.steps[0].values["xi"]
    assert ndc[0] == pytest.approx(2 * (column + xi[0]) / SIZE[0] - 1, abs=1e-6)
    assert ndc[1] == pytest.approx(2 * (SIZE[1] - 1 - row + xi[1]) / SIZE[1] - 1, abs=1e-6)
    hit = found.steps[2]
    assert any("the nearest so far" in step.verdict for step in hit.find("a triangle is tried"))
    surface = found.steps[4].values
    moved = surface["origin"] - surface["position"]
    assert 0 < np.dot(moved, surface["geometric_normal"]) < 1e-4
    (of_brdf,), (of_light,) = found.find("a direction from the BRDF"), found.find("a sample of the lights")
    (along,) = found.find("light from a direction")
    assert along.values["w_i"].tolist() == of_brdf.values["w_i"].tolist()
    assert of_light.values["L_i"].max() > 0
    assert np.array_equal(found.steps[5].values["reflected"], found.value)
    assert "a triangle is tried" in str(found)
    assert "light 1" in found.drawing()  # from the first surface


@pytest.mark.parametrize(
    ("pixel", "message"),
    [
        ((24, 0), "the column must be a whole number from 0 to 23, not 24"),
        ((0, -1), "the row must be a whole number from 0 to 15, not -1"),
        ((0, 0, 5), "the sample must be a whole number from 0 to 4, not 5"),
    ],
)
def test_a_pixel_that_is_not_there_is_an_error(picture, pixel, message):
    with pytest.raises(InputError, match=message):
        picture.explain(*pixel)
