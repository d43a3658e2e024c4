"""An observed part does what the part does, whatever was replaced, and its observer sees every call."""

import ast
from pathlib import Path
from types import SimpleNamespace

import pytest
import taichi as ti

import taichi_tracer
from taichi_tracer.system.observed import after, observed, observed_scene
from taichi_tracer.system.seams import called, in_kernels

pytestmark = pytest.mark.usefixtures("f32")


@ti.data_oriented
class Part:
    """A part with two methods, of which one calls the other."""

    def __init__(self, factor):
        self.factor = factor

    @ti.func
    def scaled(self, number, plus=0):
        return self.factor * number + plus

    @ti.func
    def twice(self, number):
        return 2 * self.scaled(number)


@ti.data_oriented
class Mine(Part):
    """A student's."""

    @ti.func
    def scaled(self, number, plus=0):
        return 100 * number + plus


@ti.data_oriented
class Static(Part):
    """A student's, whose method is static."""

    @staticmethod
    @ti.func
    def scaled(number, plus=0):
        return 1000 * number + plus


@ti.func
def without_self(number, plus=0):
    return 7 * number + plus


def assigned_to_class():
    cls = type("Assigned", (Part,), {})
    cls.scaled = without_self
    return cls(3)


def assigned_to_object():
    part = Part(3)
    part.scaled = without_self
    return part


@ti.kernel
def ask(part: ti.template(), number: ti.i32) -> ti.i32:
    return called(part.scaled, number, plus=1)


@ti.kernel
def ask_twice(part: ti.template(), number: ti.i32) -> ti.i32:
    return part.twice(number)


WAYS = {
    "as it is": lambda: Part(3),
    "a subclass": lambda: Mine(3),
    "a static method": lambda: Static(3),
    "assigned to the class": assigned_to_class,
    "assigned to the object": assigned_to_object,
}


@pytest.mark.parametrize("way", WAYS)
def test_the_observer_sees_the_call_of_every_kind_of_method(way):
    part, seen = WAYS[way](), ti.field(ti.i32, 3)

    @in_kernels
    def see(of, result, number, plus):
        assert isinstance(of, type(part))
        keep(seen, number, plus, result)

    watched = observed(part, {"scaled": after(see), "absent": None})
    assert type(watched).__mro__[1] is type(part)
    assert not hasattr(watched, "absent")
    expected = ask(part, 5)
    assert seen.to_numpy().tolist() == [0, 0, 0]
    assert ask(watched, 5) == expected
    assert seen.to_numpy().tolist() == [5, 1, expected]


@ti.func
def keep(seen: ti.template(), number, plus, result):
    seen[0], seen[1], seen[2] = number, plus, result


def plus(watcher, part, call, number):
    """The number is larger by that of the watcher."""
    return call(number + watcher.factor)


def test_a_scene_is_observed_with_its_parts_and_the_surfaces_that_it_makes():
    made = Part(3)

    class Scene(SimpleNamespace):
        def surface_at(self, ray, hit):
            return made

    scene = Scene(lights=Part(1), ray_intersector=Part(2))
    seen = []
    observers = {
        "scene": {"surface_at": lambda of, call, *given: seen.append(call(*given)) or seen[-1]},
        "surface": {"scaled": lambda of, call, number: 5},
        "lights": {"scaled": lambda of, call, number: 6},
    }
    watched = observed_scene(scene, observers)
    surface = watched.surface_at(None, None)
    assert seen == [surface]  # the scene's observer gets the surface that is observed
    assert ask_twice(surface, 1) == 10
    assert ask_twice(watched.lights, 1) == 12
    assert watched.ray_intersector is scene.ray_intersector
    assert scene.surface_at(None, None) is made


def test_samples_begin_in_one_place():
    """One loop begins the samples of pictures: whoever watches a sample uses this loop.

    The checks of the assignments and of parts ask for random numbers, too, but make no picture; and ``course`` counts
    samples of an environment.
    """
    package = Path(taichi_tracer.__file__).parent
    found = set()
    for path in package.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call)]
        if any(getattr(call.func, "attr", "") == "start" and len(call.args) == 4 for call in calls):
            found.add(path.relative_to(package).parts[0])
    assert found == {"progressive.py", "teaching", "contracts", "course"}
