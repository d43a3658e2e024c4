"""Maps of work: what they count is what an explained sample counts, and what is measured stays as it is."""

import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.system.errors import InputError

SIZE = (16, 12)


@pytest.fixture(scope="module")
def scene():
    start("f32")
    return tt.load_scene_data("cube", environment="studio")


@pytest.fixture(scope="module")
def maps(scene):
    return tt.MapRenderer(scene, *SIZE, of="uniform")


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


def test_triangles_of_objects_in_several_places_are_counted(scene):
    cube = tt.load_mesh("cube")
    places = [[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] for x in (0, 4)]
    shared = tt.scene_from_mesh(tt.group([tt.Instances(cube, places)]), instances="shared")
    assert tt.MapRenderer(shared, *SIZE, of="normal").use("triangles").image().max() >= 1
