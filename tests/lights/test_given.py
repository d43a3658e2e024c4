"""Lights that are described by numbers: other numbers compile nothing, and ``repr`` gives the light again."""

import pytest

import taichi_tracer as tt
from taichi_tracer.lights.delta_lights import GivenLight
from taichi_tracer.system.parts import PARTS

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("light", [one for one in PARTS.all("light") if isinstance(one, GivenLight)], ids=repr)
def test_repr_makes_the_same_light_again(light):
    again = eval(repr(light), {"tt": tt})
    assert type(again) is type(light)
    assert again.facts() == light.facts()


def test_every_light_of_the_package_is_one():
    assert {light.name for light in PARTS.all("light")} >= {"ambient", "directional", "point", "spot"}
