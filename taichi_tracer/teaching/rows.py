"""Calls a function of kernels for every row of some inputs, and collects what it returns.

A part gives a student's method, or a ``ti.func`` of its own that calls this method, to ``rows``. If the answers are
random, it gives it to ``samples``, which calls it many times for each row. So no part needs a kernel of its own.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import taichi as ti
from taichi.lang.util import to_numpy_type

from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.teaching.base import Arrays

WHOLE = 0  # stands in place of a width: the answer is one whole number
SEED = 5  # of the random numbers of all parts; the inputs of a part have a seed of their own


def rows(
    function: Callable, inputs: Arrays, names: Sequence[str], answers: Mapping[str, int], numbers: range = range(0)
) -> Arrays:
    """What a function of kernels returns for every row of some inputs.

    Args:
        function: a ``ti.func``, or a method that is one. It returns one value, or a tuple with one for each answer.
        inputs, names: the names of the arrays of ``inputs`` whose rows are its arguments, in this order. A row of an
            (n,) array is a number, and one of an (n, k) array is a vector. Real numbers are rounded to f32.
        answers: name → how many numbers the answer has: 1 or more real ones, or ``WHOLE``.
        numbers: the numbers of the rows, for a function without arguments.

    Returns:
        Name → (n,) or (n, width) array.
    """
    found = _Calls(function, [inputs[name] for name in names], answers).of_rows(numbers, 1)
    return {name: np.ascontiguousarray(array[:, 0]) for name, array in found.items()}


def samples(
    function: Callable,
    inputs: Arrays,
    names: Sequence[str],
    answers: Mapping[str, int],
    count: int,
    numbers: range = range(0),
) -> Arrays:
    """What a function that draws random numbers returns, ``count`` times for every row; see ``rows``.

    Args:
        numbers: the numbers of the rows, for a function without arguments. Rows with different numbers have different
            random numbers.

    Returns:
        Name → (n, count) or (n, count, width) array.
    """
    return _Calls(function, [inputs[name] for name in names], answers, is_random=True).of_rows(numbers, count)


class Column(NamedTuple):
    """Where a value stands in a row of a table.

    A table has 32 bits in each place: a whole number, or the bits of a real one.

    Attributes:
        first: its first place. width: how many places it has if it is a vector; 0 for a number, which has one.
        dtype: of its numbers, ``ti.i32`` or ``ti.f32``.
    """

    first: int
    width: int
    dtype: Any


def columns_of(kinds: Iterable[tuple[int, bool]]) -> tuple[Column, ...]:
    """The columns of (width, whether it is whole), one after the other."""
    found, at = [], 0
    for width, is_whole in kinds:
        found.append(Column(at, width, ti.i32 if is_whole else ti.f32))
        at += max(1, width)
    return tuple(found)


@ti.data_oriented
class _Calls:
    """Calls of one function; see ``rows``.

    Args:
        given: the arrays whose rows are the arguments.
        is_random: whether the function draws random numbers.
    """

    def __init__(
        self, function: Callable, given: Sequence[np.ndarray], answers: Mapping[str, int], is_random: bool = False
    ) -> None:
        self.function, self.given, self.names = function, given, tuple(answers)
        self.random, self.is_random = IndependentSampler(), is_random
        kinds = [(array.shape[1] if array.ndim > 1 else 0, array.dtype.kind in "iub") for array in given]
        self.arguments = columns_of(kinds)
        self.answers = columns_of((width if width > 1 else 0, width == WHOLE) for width in answers.values())

    def of_rows(self, numbers: range, count: int) -> Arrays:
        """The answers to all rows, ``count`` times."""
        numbers = range(len(self.given[0])) if self.given else numbers
        number = len(numbers)
        table = [np.zeros((number, 0), np.int32)]
        for array, column in zip(self.given, self.arguments, strict=True):
            plain = array.reshape(number, -1).astype(to_numpy_type(column.dtype))
            table.append(plain.view(np.int32))
        found = np.zeros((number, count, sum(max(1, column.width) for column in self.answers)), np.int32)
        self.call(numbers.start, np.concatenate(table, axis=1), found)
        answers = {}
        for name, (at, width, dtype) in zip(self.names, self.answers, strict=True):
            array = np.ascontiguousarray(found[..., at : at + max(1, width)]).view(to_numpy_type(dtype))
            answers[name] = array if width else array[..., 0]
        return answers

    @ti.kernel
    def call(self, first: ti.i32, table: ti.types.ndarray(ndim=2), found: ti.types.ndarray(ndim=3)):
        """Call the function for each row of a table."""
        for i, j in ti.ndrange(found.shape[0], found.shape[1]):
            if ti.static(self.is_random):
                self.random.start(ti.u32(SEED), first + i, 0, j)
            answer = self.function(*[read(table, i, column) for column in ti.static(self.arguments)])
            if ti.static(len(self.answers) == 1):
                write(found, i, j, self.answers[0], answer)
            else:
                for k in ti.static(range(len(self.answers))):
                    write(found, i, j, self.answers[k], answer[k])


@ti.func
def read(table: ti.template(), i, column: ti.template()):
    """The value of a column in row i: a number or a vector."""
    if ti.static(column.width == 0):
        return ti.bit_cast(table[i, column.first], column.dtype)
    else:  # noqa: RET505 (without it, both would be compiled)
        return ti.Vector([ti.bit_cast(table[i, column.first + k], column.dtype) for k in range(column.width)])


@ti.func
def write(found: ti.template(), i, j, column: ti.template(), value):
    """Write a number or a vector as call j of row i."""
    if ti.static(column.width == 0):
        found[i, j, column.first] = bits(value, column.dtype)
    else:
        for k in ti.static(range(column.width)):
            found[i, j, column.first + k] = bits(value[k], column.dtype)


@ti.func
def bits(value, dtype: ti.template()):
    """A number, rounded to a type, as 32 bits."""
    return ti.bit_cast(ti.cast(value, dtype), ti.i32)
