"""Which methods were replaced, however it was done, and how a method is called by its own signature."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import ask, put

import taichi_tracer as tt
from taichi_tracer.environment import Environment
from taichi_tracer.formulas.hashes import reverse_bits
from taichi_tracer.sampler import BRDF, UniformSampler
from taichi_tracer.system.registry import PARTS
from taichi_tracer.system.seams import (
    assigned,
    called,
    element,
    fit,
    in_kernels,
    in_kernels_as,
    replaced,
    runs_in_kernels,
    seams,
    takes,
    takes_whole_numbers,
    variable,
    why_replaced,
)


@seams("first", "second")
class Plain:
    """Comes with the package, as it were."""

    def first(self):
        return 1

    def second(self):
        return 2

    def third(self):
        return 3


@seams("third")
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


def test_a_subclass_of_a_subclass_replaces_what_any_of_them_defines():
    class Yours(Mine):
        def third(self):
            return 30

        def fourth(self):
            return 40

    assert replaced(Yours) == ("second", "third")
    assert why_replaced(Yours()) == "Yours replaces second, third"


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


def test_a_method_that_is_no_seam_replaces_nothing():
    class Yours(Plain):
        def third(self):
            return 0

    assert replaced(Yours) == ()


def test_what_does_not_derive_from_the_package_has_no_seams():
    assert replaced(object) == replaced(7) == ()
    assert why_replaced(object()) == ""


@pytest.mark.parametrize("kind", ["camera", "intersector", "sampler", "BRDF", "renderer"])
def test_no_part_of_the_package_replaces_anything(kind):
    """Fast forms and receipts ask these: what comes with the package is what it is compared with."""
    shipped = [part for part in PARTS.all(kind) if PARTS.comes_with_package(part)]
    assert {part.name: replaced(part) for part in shipped} == {part.name: () for part in shipped}


def test_the_handouts_own_classes_replace_nothing():
    for part in (tt.Environment, BRDF, UniformSampler, Environment(np.ones((1, 1, 3))), BRDF()):
        assert replaced(part) == ()
    assert assigned() == []


# ── how a method is called ──


def test_signatures_are_asked():
    def full(self, a: int, b=2, *, jitter=False):
        return a, b, jitter

    assert takes(full, "jitter")
    assert not takes(full, "xi")
    assert takes_whole_numbers(full)
    assert takes_whole_numbers(lambda: 0) is False


@pytest.mark.parametrize(
    ("annotation", "is_whole"), [(ti.i32, True), (ti.u8, True), (int, True), (float, False), (ti.f32, False)]
)
def test_the_first_argument_after_self_says_whether_it_takes_whole_numbers(annotation, is_whole):
    def with_self(self, pixel_x, pixel_y):
        return 0

    with_self.__annotations__["pixel_x"] = annotation
    assert takes_whole_numbers(with_self) is is_whole


def test_only_what_a_method_takes_is_offered_to_it():
    class Part:
        def short(self, a):
            return a

        def long(self, a, xi=None, jitter=False):
            return a, xi, jitter

    part = Part()
    assert called(part.short, 1, xi=2, jitter=True) == 1
    assert called(part.long, 1, xi=2, jitter=True) == (1, 2, True)
    assert called(part.long, 1, xi=2) == (1, 2, False)
    assert called(lambda a, xi: (a, xi), 1, xi=2) == (1, 2)


def test_a_function_without_self_is_called_without_it(monkeypatch):
    monkeypatch.setattr(Plain, "first", lambda a, xi=0: (a, xi), raising=True)
    assert called(Plain().first, 7, xi=3) == (7, 3)
    monkeypatch.setattr(Plain, "first", lambda: "nothing")
    assert called(Plain().first, xi=3) == "nothing"


def test_a_method_with_fewer_parameters_gets_the_first_arguments():
    @seams("sample")
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
        fit(cls)
    assert Fewer().sample(1, 2, 3) == (1, 2)
    assert Renamed().sample(1, 2, 3) == 3
    assert Untouched().sample(1, 2, 3) == (1, 2, 3)
    assert (Fewer.sample, replaced(Fewer())) == (own, ("sample",))
    assert "sample" not in vars(Untouched)
    Fewer.sample = lambda self, scene, surface: scene  # in a notebook, later
    fit(Fewer)
    assert Fewer().sample(1, 2, 3) == 1


# ── Python that kernels call while they are compiled ──


@ti.func
def _twice(x):
    return 2 * x


@in_kernels
def _chosen(x, how):
    """Chooses in Python, and calls a Taichi function."""
    return _twice(x) if how == "twice" else x


@ti.func
def _probe(rows: ti.template(), out: ti.template(), i):
    put(out, i, 0, tm.vec3(_chosen(rows[i, 0], "twice"), _chosen(rows[i, 0], "once"), called(_twice, rows[i, 0], xi=3)))


def test_a_kernel_calls_a_python_function_while_it_is_compiled(precision):
    np.testing.assert_array_equal(ask(_probe, [[3], [5]], 3), [[6, 3, 6], [10, 5, 10]])
    assert _chosen(4, "once") == 4  # from Python as well


@in_kernels
def _sum_of_squares(table, row):
    numbers = [variable(element(table, row, k) + 1) for k in range(2)]
    return variable(sum(number * number for number in numbers))


def test_such_a_function_reads_elements_and_keeps_what_it_uses_twice(precision):
    table = ti.field(float, (2, 2))
    table.from_numpy(np.array([[1, 2], [3, 4]], np.float64))

    @ti.kernel
    def both(out: ti.types.ndarray(ndim=1)):
        for i in range(2):
            out[i] = _sum_of_squares(table, i)

    out = np.zeros(2)
    both(out)
    np.testing.assert_array_equal(out, [13, 41])
    with pytest.raises(ti.TaichiSyntaxError, match="cannot be called from Python-scope"):
        reverse_bits(5)


def test_what_was_written_for_kernels_alone_is_told_apart():
    assert runs_in_kernels(_twice)
    assert not runs_in_kernels(_chosen)
    assert not runs_in_kernels(lambda: 0)


def test_a_method_of_python_has_another_value_in_kernels(f32):
    class Answer:
        @in_kernels_as(lambda answer: answer.inside)
        def value(self):
            """The answer."""
            return self.outside

    answer = Answer()
    answer.inside, answer.outside = 3, "three"

    @ti.kernel
    def ask() -> ti.i32:
        return answer.value()

    assert (answer.value(), ask()) == ("three", 3)
    assert Answer.value.__doc__ == "The answer."
