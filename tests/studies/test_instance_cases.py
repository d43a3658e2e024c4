"""The hard cases of objects in several places: they pass, and each finds the mistake that it is about."""

import numpy as np
import pytest

import taichi_tracer.instances
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Placed
from taichi_tracer.studies.hard import instance_cases
from taichi_tracer.studies.hard.catalogue import LEVELS, all_renderer_cases

EPSILON = 2.0**-23

pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("case", [*instance_cases.INSTANCES])
def test_it_passes(case):
    found = case().judge(EPSILON)
    assert found["tried"] > 5
    assert (found["wrong"], found["nan"]) == (0, 0)


def test_the_suite_tries_them():
    assert set(instance_cases.INSTANCES) <= {type(case) for case in all_renderer_cases(("brdf",))}
    assert set(instance_cases.LARGE) <= set(LEVELS["full"].paths)


def test_what_is_left_out_because_it_has_no_inverse_is_found(monkeypatch):
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    monkeypatch.setattr(taichi_tracer.instances, "_copy", lambda mesh, matrix: nothing)
    assert instance_cases.ScaledToNothing().judge(EPSILON)["wrong"] > 0


def test_numbers_that_begin_at_the_wrong_place_are_found(monkeypatch):
    plain = Placed.starts.fget
    monkeypatch.setattr(Placed, "starts", property(lambda placed: plain(placed) + (plain(placed) > 40)))
    assert instance_cases.SomePlaces().judge(EPSILON)["wrong"] > 0
