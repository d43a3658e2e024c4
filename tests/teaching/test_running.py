"""How parts run: what is said of a crash, and which classes stand beside the one under test."""

import pytest

from taichi_tracer.teaching.base import Part
from taichi_tracer.teaching.loading import Loaded, one_line
from taichi_tracer.teaching.running import beside_the_solution


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("[Errno 13] Permission denied: 'x'", "[Errno 13] Permission denied: 'x'"),
        ("File 'a.py', line 3:\n    x = y[0]\n        ^^^^\n[Name 'y' is not defined", "Name 'y' is not defined"),
        ("", ""),
    ],
)
def test_the_last_line_of_a_message(message, told):
    assert one_line(OSError(message)) == told


class Renderer:
    """A class that a student wrote in this file, as in a cell of a notebook."""

    def value(self):
        return Lamp.value, Mine.value, Missing.value  # noqa: F821 (in a cell that comes later)


class Lamp:
    """A class of another cell."""

    value = "the student's"


class Mine:
    """The same, under a name of the student's own."""

    value = "the student's"


def test_in_a_notebook_the_solution_stands_beside_the_class_under_test():
    def solved(name):
        return type(name, (), {"value": "the solution's"})

    student = Loaded({"Renderer": Renderer, "Sampler": Mine})
    solution = Loaded({name: solved(name) for name in ("Renderer", "Lamp", "Sampler", "Missing")})
    files = {"Renderer": "renderer.py", "Lamp": "lamp.py", "Sampler": "lamp.py", "Missing": "lamp.py"}
    part = Part("Renderer.value", 1, "", "Renderer", None, None, None)
    with beside_the_solution(part, student, solution, files):
        assert Renderer().value() == ("the solution's",) * 3
    assert (Lamp.value, Mine.value) == ("the student's",) * 2
    assert "Missing" not in globals()
