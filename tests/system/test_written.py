"""A method that gives nothing where something is needed is one line, before a compiler ends the process."""

import pytest
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.written import check, gives_nothing


class NoDensity(Brdf):
    """A BRDF whose density has no return."""

    name = "no density"

    def describes(self, material, dtype):
        return True

    @ti.func
    def eval(self, material, w_o, w_i, n):
        return material.Kd / 3.14

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        p = 0.3  # noqa: F841

    @ti.func
    def sample(self, material, w_o, n, xi):
        return n


def test_a_forgotten_return_is_told_with_its_line(f32):
    told = r"test_written.py:\d+: NoDensity.pdf has no return: it must return The density of ``sample`` at w_i"
    with pytest.raises(InputError, match=told):
        tt.load_scene_data("cube", environment="studio", brdfs=[NoDensity()])


def test_what_returns_in_some_way_is_not_judged_here():
    def some(x):
        if x > 0:
            return x
        return None

    check("A", "f", some, lambda x: x)
    check("A", "f", lambda: None, some)
    assert not gives_nothing(print)


def test_a_method_that_need_not_return_may_give_nothing():
    def nothing(x):
        x + 1

    check("A", "f", nothing, nothing)
    with pytest.raises(InputError, match="A.g has no return: it must return"):
        check("A", "g", nothing, eval_of)


def eval_of(x):
    return x
