"""Which methods were replaced, however it was done, and how a method is called by its own signature."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import ask, put

from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.parts.overrides import (
    adapt_signature,
    assigned,
    call_with_known_args,
    overridable,
    replaced,
    why_replaced,
)


@overridable("first", "second")
class Plain:
    """Comes with the package, as it were."""

    def first(self):
        return 1

    def second(self):
        return 2

    def third(self):
        return 3


@overridable("third")
class Shipped(Plain):
    """Also comes with the package: its own ``first`` is no replacement."""

    def first(self):
        return 10


class Mine(Shipped):
    """A user's."""

    def second(self):
        return 20


# ── what was replaced ──


def test_a_subclass_replaces_what_it_defines():
    assert replaced(Plain) == replaced(Plain()) == ()
    assert replaced(Shipped) == replaced(Shipped()) == ()
    assert replaced(Mine) == replaced(Mine()) == ("second",)
    assert why_replaced(Mine) == why_replaced(Mine()) == "Mine replaces second"
    assert why_replaced(Plain) == ""


@pytest.mark.parametrize(
    ("owner", "name"), [(Plain, "first"), (Plain, "second"), (Shipped, "first"), (Shipped, "third")]
)
def test_assigning_to_a_class_replaces_for_it_and_for_those_that_inherit_it(monkeypatch, owner, name):
    monkeypatch.setattr(owner, name, lambda self: -1)
    assert replaced(owner) == (name,)
    inherits = not (owner is Plain and name == "first")  # Shipped has its own
    assert (name in replaced(Shipped)) == inherits
    assert f"{owner.__name__}.{name}" in assigned()
    monkeypatch.undo()
    assert replaced(owner) == ()
    assert f"{owner.__name__}.{name}" not in assigned()


def test_assigning_to_an_object_replaces_for_it_alone():
    one, other = Shipped(), Shipped()
    one.second = lambda: -1
    assert replaced(one) == ("second",)
    assert replaced(other) == ()
    assert why_replaced(one) == "Shipped replaces second"


# ── how a method is called ──


def test_a_function_without_self_is_called_without_it(monkeypatch):
    monkeypatch.setattr(Plain, "first", lambda a, xi=0: (a, xi), raising=True)
    assert call_with_known_args(Plain().first, 7, xi=3) == (7, 3)
    monkeypatch.setattr(Plain, "first", lambda: "nothing")
    assert call_with_known_args(Plain().first, xi=3) == "nothing"


def test_a_method_with_fewer_parameters_gets_the_first_arguments():
    @overridable("sample")
    class Shipped:
        def sample(self, scene, surface, xi):
            return scene, surface, xi

    class Fewer(Shipped):
        def sample(self, scene, surface):
            return scene, surface

    class Renamed(Shipped):
        def sample(self, scene, surface, pair):
            return pair

    class Untouched(Shipped):
        pass

    own = vars(Fewer)["sample"]
    for cls in (Fewer, Renamed, Untouched, Fewer):
        adapt_signature(cls)
    assert Fewer().sample(1, 2, 3) == (1, 2)
    assert Renamed().sample(1, 2, 3) == 3
    assert Untouched().sample(1, 2, 3) == (1, 2, 3)
    assert (Fewer.sample, replaced(Fewer())) == (own, ("sample",))
    assert "sample" not in vars(Untouched)
    Fewer.sample = lambda self, scene, surface: scene  # in a notebook, later
    adapt_signature(Fewer)
    assert Fewer().sample(1, 2, 3) == 1


# ── Python that kernels call while they are compiled ──


@ti.func
def _twice(x):
    return 2 * x


@compile_time
def _chosen(x, how):
    """Chooses in Python, and calls a Taichi function."""
    return _twice(x) if how == "twice" else x


@ti.func
def _probe(rows: ti.template(), out: ti.template(), i):
    put(
        out,
        i,
        0,
        tm.vec3(
            _chosen(rows[i, 0], "twice"), _chosen(rows[i, 0], "once"), call_with_known_args(_twice, rows[i, 0], xi=3)
        ),
    )


def test_a_kernel_calls_a_python_function_while_it_is_compiled(precision):
    np.testing.assert_array_equal(ask(_probe, [[3], [5]], 3), [[6, 3, 6], [10, 5, 10]])
    assert _chosen(4, "once") == 4  # from Python as well
