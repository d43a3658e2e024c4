"""An explained pixel has the bits of the picture, and its steps are those of the code that runs."""

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.system.errors import InputError

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
    path, _ = found.drawings()
    assert "light 1" in path  # from the first surface


@pytest.mark.parametrize(
    ("pixel", "message"),
    [
        ((24, 0), "the column must be from 0 to 23, not 24"),
        ((0, -1), "the row must be from 0 to 15, not -1"),
        ((0, 0, 5), "the sample must be from 0 to 4, not 5"),
    ],
)
def test_a_pixel_that_is_not_there_is_an_error(picture, pixel, message):
    with pytest.raises(InputError, match=message):
        picture.explain(*pixel)
