"""A function of kernels is called for every row, and each answer comes back with its shape, type and bits."""

import numpy as np
import pytest
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.teaching.rows import WHOLE, rows, samples
from taichi_tracer.teaching.running import reproducible_random

RNG = np.random.default_rng(3)
INPUTS = {"v": RNG.normal(size=(5, 3)).astype(np.float32), "x": np.array([0, 1, -2.5, np.inf, np.nan], np.float32)}
INPUTS |= {"id": np.array([-1, 0, 1, 2**24 + 1, 2**31 - 1], np.int32), "pixel": np.arange(10).reshape(5, 2)}


pytestmark = pytest.mark.usefixtures("f32")


@ti.func
def everything(v, x, number, pixel):
    """Answers of all kinds."""
    return x, tt.Ray(origin=v, direction=2 * v).direction, number, pixel.x + number * 0, pixel


@ti.func
def random(_number):
    """One random number."""
    return ti.random()


@ti.func
def constant():
    """A function without arguments."""
    return 7


def test_every_answer_has_its_shape_type_and_bits():
    answers = {"x": 1, "twice": 3, "number": WHOLE, "left": WHOLE, "pixel": 2}
    found = rows(everything, INPUTS, ["v", "x", "id", "pixel"], answers)
    assert list(found) == list(answers)
    np.testing.assert_array_equal(found["x"], INPUTS["x"])
    np.testing.assert_array_equal(found["twice"], 2 * INPUTS["v"])
    np.testing.assert_array_equal(found["number"], INPUTS["id"])
    np.testing.assert_array_equal(found["left"], INPUTS["pixel"][:, 0])
    np.testing.assert_array_equal(found["pixel"], INPUTS["pixel"])
    assert {name: array.dtype for name, array in found.items()} == {
        name: np.dtype(np.int32 if width == WHOLE else np.float32) for name, width in answers.items()
    }


def test_a_function_without_arguments_is_called_for_numbers():
    assert rows(constant, {}, [], {"seven": WHOLE}, range(3))["seven"].tolist() == [7, 7, 7]


def test_samples_differ_between_rows_and_are_the_same_again():
    with reproducible_random():
        first, again = (samples(random, INPUTS, ["id"], {"xi": 1}, 100)["xi"] for _ in range(2))
    assert first.shape == (5, 100)
    assert len(np.unique(first)) > 490
    np.testing.assert_array_equal(first, again)
    assert 0 <= first.min() < first.max() < 1


def test_rows_are_numbered():
    """The numbers of row 7 do not depend on the row with which the call begins."""

    @ti.func
    def number():
        return ti.random()

    with reproducible_random():
        from_five, from_seven = (samples(number, {}, [], {"xi": 1}, 4, range(n, 9))["xi"] for n in (5, 7))
    np.testing.assert_array_equal(from_five[2:], from_seven)
