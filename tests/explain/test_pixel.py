"""An explained pixel has the bits of the picture, and its steps are those of the code that runs."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
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


@pytest.mark.long
def test_the_mean_is_the_pixel_to_the_last_bit(picture):
    image = picture.image()
    for row, column in np.ndindex(SIZE[1], SIZE[0]):
        found = picture.explain(column, row, (row + column) % 5)
        assert np.array_equal(found.mean, image[row, column])
    assert np.array_equal(found.error, picture.error_image()[row, column])


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


@pytest.mark.exhaustive
def test_a_view_is_explained_too(cube):
    renderer = tt.A1Renderer(cube, *SIZE).use("normal").render()
    found = one_that_hits(renderer)
    assert np.array_equal(found.mean, renderer.image()[found.row, found.column])
    assert np.allclose(found.mean, (found.find("query_segment")[0].values["normal"] + 1) / 2, atol=1e-6)


@pytest.mark.long
def test_what_a_student_replaced_is_what_is_explained(cube):
    @ti.data_oriented
    class Shifted(tt.Camera):
        @ti.func
        def generate_ndc_coords(self, pixel_x, pixel_y):
            return tm.vec2(0.25, -0.125)

    renderer = tt.A1Renderer(cube, *SIZE, camera=Shifted).use("distance").render()
    found = renderer.explain(2, 3)
    (step,) = found.find("generate_ndc_coords")
    assert step.values["ndc"].tolist() == [0.25, -0.125]
    assert np.array_equal(found.mean, renderer.image()[3, 2])


@pytest.mark.exhaustive
def test_samples_that_were_not_rendered_can_be_explained(cube):
    renderer = tt.A2Renderer(cube, *SIZE, seed=3).use("brdf")
    before = renderer.explain(10, 8, sample=3, samples=4)
    renderer.render(4)
    assert np.array_equal(before.mean, renderer.image()[8, 10])
    assert np.array_equal(before.value, renderer.explain(10, 8, 3).value)


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


def compare(scene, renderer_class, name, precision_sampler="niederreiter", count=4):
    renderer = renderer_class(scene, *SIZE, sampler=precision_sampler).use(name).render(3)
    image, rng = renderer.image(), np.random.default_rng(7)
    for _ in range(count):
        column, row = (int(rng.integers(n)) for n in SIZE)
        found = renderer.explain(column, row, 2 if renderer.is_random else 0)
        assert np.array_equal(found.mean.astype(np.float32), image[row, column]), (name, column, row)


CLASSES = (tt.A1Renderer, tt.A2Renderer, tt.A3Renderer, tt.A4Renderer)
WAYS = [(c, name) for c in CLASSES for name in c.names() if c is not tt.A3Renderer or name == "mis_one_sample"]


@pytest.mark.exhaustive
@pytest.mark.parametrize("precision", ["f32", "f64"])
@pytest.mark.parametrize("fast", [True, False], ids=["fast", "plain"])
@pytest.mark.parametrize(("renderer_class", "name"), WAYS)
def test_every_way_has_the_bits_of_its_picture(renderer_class, name, fast, precision):
    """A hundred pixels in all of every precision and form, in scenes with lamps, mirrors and glass."""
    start(precision)
    for scene_name in ("cornell_box", "caustic_sphere"):
        scene = tt.load_scene_data(scene_name, fast=fast)
        compare(scene, renderer_class, name, count=3)
        compare(scene, renderer_class, name, "independent", count=2)
        scene.destroy()
    start("f32")


@pytest.mark.exhaustive
def test_paths_under_a_sky_with_spheres():
    start("f32")
    scene = tt.load_scene_data("rt3/three_spheres", environment="studio")
    compare(scene, tt.A4Renderer, "path", count=6)
    scene.destroy()


@pytest.mark.exhaustive
def test_the_boxes_of_the_plain_hierarchy_are_noted(cube):
    scene = tt.load_scene_data("cornell_box", fast=False)
    found = one_that_hits(tt.A1Renderer(scene, *SIZE).use("hit").render())
    boxes = found.find("a box is tried")
    assert found.counts["a box is tried"] == len(boxes) > 3
    assert boxes[0].values["node"] == 0
    assert all(step.values["is_met"] == (step.values["t_near"] <= step.values["t_far"]) for step in boxes)
    assert "boxes tried" in found.work


@pytest.mark.exhaustive
def test_another_camera_and_another_start_are_noticed():
    start("f32")  # others of this file start Taichi again, so that the scene of the fixture may be gone
    renderer = tt.A1Renderer(tt.load_scene_data("cube"), *SIZE).use("distance").render()
    before = one_that_hits(renderer)
    renderer.camera = tt.OrthographicCamera(*SIZE, eye=(0, 0, 9), at=(0, 0, 0), screen_window=(-2, 2, -2, 2))
    assert renderer.explain(before.column, before.row).find("generate_ray")[0].values["direction"].tolist() == [
        0,
        0,
        -1,
    ]
