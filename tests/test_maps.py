"""Maps of work: what they count is what an explained sample counts, and what is measured stays as it is."""

import numpy as np
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
