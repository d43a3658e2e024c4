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
