"""A name that a function uses is part of what a kernel was read for, also if Python runs the function."""

import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
import taichi as ti
from support import any_scene, long_except, needs_arrays, needs_patch, start

import taichi_tracer as tt
from taichi_tracer.formulas import hashes
from taichi_tracer.system import compiling
from taichi_tracer.system.seams import in_kernels
from taichi_tracer.system.taichi_17 import names

FACTOR, FACTORS, TABLE = 0.25, [1.0, 0.25], {"factor": 0.25}


@dataclass
class Settings:
    """What a student gathers in a notebook."""

    factor: float
    weight: ClassVar[float] = 0.25


SETTINGS = Settings(0.25)


@pytest.fixture(autouse=True)
def fresh():
    start("f32")
    needs_arrays()
    needs_patch("counters")


def number():
    return FACTOR


def number_of_another_function():
    return 1 * number()


def element_of_a_list():
    return FACTORS[-1]


def number_of_a_dictionary():
    return TABLE["factor"]


def attribute_of_a_class():
    return Settings.weight


def attribute_of_an_object():
    return SETTINGS.factor


@in_kernels
def number_in_kernels():
    return FACTOR


def shown(function):
    """A class of renderers that show what a function of Python returns."""

    class Shown(tt.A1Renderer):
        @ti.func
        def shade_ray(self, ray):
            return ray.direction * 0 + ti.static(function())

    return Shown


CHANGES = {
    number: lambda patch: patch.setitem(globals(), "FACTOR", 0.5),
    number_of_another_function: lambda patch: patch.setitem(globals(), "FACTOR", 0.5),
    element_of_a_list: lambda _: FACTORS.__setitem__(1, 0.5),
    number_of_a_dictionary: lambda patch: patch.setitem(TABLE, "factor", 0.5),
    attribute_of_a_class: lambda patch: patch.setattr(Settings, "weight", 0.5),
    attribute_of_an_object: lambda patch: patch.setattr(SETTINGS, "factor", 0.5),
    number_in_kernels: lambda patch: patch.setitem(globals(), "FACTOR", 0.5),
}


@pytest.mark.parametrize("function", long_except(CHANGES, number), ids=lambda function: function.__name__)
def test_what_a_students_function_of_python_finds_is_part_of_what_a_kernel_was_read_for(function, monkeypatch):
    renderer, of = shown(function), any_scene(1)
    assert renderer(of, 8, 8).render().image().max() == 0.25
    began = time.perf_counter()
    assert renderer(of, 8, 8).render().image().max() == 0.25
    assert compiling.kernels(since=began) == []
    CHANGES[function](monkeypatch)
    assert renderer(of, 8, 8).render().image().max() == 0.5


def test_a_constant_of_the_package_is_part_of_what_a_kernel_was_read_for(monkeypatch):
    of = any_scene(1)
    first = tt.A2Renderer(of, 8, 8).use("uniform").render(1).image()
    monkeypatch.setattr(hashes, "HALVES", hashes.HALVES[1:])
    assert not np.array_equal(tt.A2Renderer(of, 8, 8).use("uniform").render(1).image(), first)
    monkeypatch.undo()
    np.testing.assert_array_equal(tt.A2Renderer(of, 8, 8).use("uniform").render(1).image(), first)


@pytest.mark.parametrize("value", [3, 2.5, "text", None, (1, (2, 3)), number, np.float32, any_scene, ti])
def test_a_constant_is_what_nobody_changes_by_calls(value):
    assert names.constant(value) is not None


@pytest.mark.parametrize("value", [[], {}, set(), (1, []), np.zeros(3), hashes.__dict__])
def test_what_the_package_fills_by_calls_is_no_constant(value):
    assert names.constant(value) is None
