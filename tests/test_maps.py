"""Maps of work: what they count is what an explained sample counts, and what is measured stays as it is."""

import numpy as np
import pytest
from contracts.registered import every
from support import start

import taichi_tracer as tt
from taichi_tracer.files.srgb import to_bytes
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import PARTS
from taichi_tracer.tones.heat import heat

SIZE = (16, 12)
MAPS = [part.name for part in PARTS.all("integrator") if part.what == "map"]


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.load_scene_data("cube", environment="studio")


@pytest.fixture(scope="module")
def maps(scene):
    return tt.MapRenderer(scene, *SIZE, of="uniform")


def counted(explanation, name):
    """What a map should show of an explained sample."""
    if name == "nodes":
        return explanation.counts.get("a node is entered", 0) + explanation.counts.get("a box is tried", 0)
    if name == "triangles":
        return explanation.counts.get("a triangle is tried", 0) + explanation.counts.get("a sphere is tried", 0)
    if name == "blocked":
        return sum(bool(step.values["is_blocked"]) for step in explanation.find("is_occluded"))
    found = 0
    normals = [step.values["normal"] for step in explanation.find("surface")]
    for step in explanation.find("sample"):
        found += float(np.dot(normals[0], step.values["w_i"])) <= 0
    return found


def test_there_are_maps_of_everything(maps):
    assert maps.names() == ["nodes", "triangles", "blocked", "below_horizon", "standard_error", "seconds"]


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("triangles", marks=pytest.mark.exhaustive),
        *(pytest.param(n, marks=pytest.mark.exhaustive) for n in ("nodes", "blocked", "below_horizon")),
    ],
)
def test_a_map_counts_what_an_explained_sample_counts(maps, name):
    maps.use(name).render(1)
    image = maps.image()
    rng = np.random.default_rng(3)
    for _ in range(12):
        column, row = (int(rng.integers(n)) for n in SIZE)
        assert (image[row, column] == counted(maps.explain(column, row), name)).all(), (column, row)
    assert image.max() > image.min() or name in ("blocked", "nodes")  # a cube needs a single node


@pytest.mark.exhaustive
def test_half_of_the_directions_on_the_sphere_are_below_the_horizon(maps, scene):
    share = maps.use("below_horizon").render(64).image()[..., 0]
    inside = tt.A2Renderer(scene, *SIZE, seed=1)
    seen = inside.aov("material_id") >= 0
    middle = seen[1:-1, 1:-1] & seen[:-2, 1:-1] & seen[2:, 1:-1] & seen[1:-1, :-2] & seen[1:-1, 2:]
    assert share[1:-1, 1:-1][middle].mean() == pytest.approx(0.5, abs=0.03)


@pytest.mark.exhaustive
def test_the_standard_error_is_that_of_the_picture(maps, scene):
    image = maps.use("standard_error").render(8).image()
    picture = tt.A2Renderer(scene, *SIZE).use("uniform").render(8)
    wanted = np.nan_to_num(picture.error_image().mean(axis=2))
    assert np.array_equal(image[..., 0], wanted)
    assert np.array_equal(np.asarray(maps.canvas.to_numpy())[:, ::-1].swapaxes(0, 1), image)
    assert np.array_equal(maps.explain(8, 6, 2).mean, picture.image()[6, 8])  # of the picture that is measured


@pytest.mark.exhaustive
def test_seconds_add_up_to_the_time_of_a_sample(maps):
    image = maps.use("seconds").render(2).image()[..., 0]
    assert 0 < image.mean() < 1e-3


@pytest.mark.exhaustive
def test_files_show_heat_up_to_a_round_number_that_is_told(maps):
    maps.use("triangles").render(1)
    high = maps.scale.high
    assert 0 < np.percentile(maps.image(), 99) <= high
    assert high == pytest.approx(float(f"{high:.0e}"))
    assert "triangles and spheres tried per sample, of uniform" in maps.notes()[0]
    shown = to_bytes(maps.image(), maps.srgb, maps.display)
    linear = heat(maps.image()[..., 0].astype(np.float64), high)
    assert np.array_equal(shown[..., 2] > 0, linear[..., 2] > 1e-6)
    maps.set_display(exposure=-3)
    assert maps.scale.high == 8
    maps.set_display(exposure=0, tone="none")
    assert maps.scale.high == high


def test_what_can_be_measured(maps):
    with pytest.raises(InputError, match="nonsense"):
        maps.of = "nonsense"
    with pytest.raises(InputError, match="nodes"):
        maps.of = "nodes"
    assert "path" in maps.controls()[0].names
    maps.change("of", "mis_power")
    assert maps.of == "mis"
    assert not maps.is_current()
    maps.of = "uniform"


@pytest.mark.exhaustive
@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize("of", ["normal", "mis", "path", "explicit"])
@every("integrator", lambda part: part.what == "map" and part.number is not None)
def test_every_map_of_paths_and_views(part, of, fast):
    """In a scene with lamps, mirrors and glass, in the fast and in the plain form."""
    start("f32")
    scene = tt.load_scene_data("caustic_sphere", fast=fast)
    renderer = tt.MapRenderer(scene, *SIZE, of=of).use(part).render(2)
    image = renderer.image()
    assert np.isfinite(image).all()
    assert image.min() >= 0
    assert renderer.non_finite == 0
    again = tt.MapRenderer(scene, *SIZE, of=of).use(part.name).render(2).image()
    assert np.array_equal(image, again)
    if part.name in ("nodes", "triangles", "blocked"):
        for column, row in ((8, 6), (3, 9), (12, 4)):
            both = [counted(renderer.explain(column, row, k), part.name) for k in range(2)]
            assert image[row, column, 0] == np.float32(np.mean(both)), (column, row, both)
    scene.destroy()
