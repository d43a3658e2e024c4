"""Calls a function of kernels for every row of some inputs, and collects what it returns.

A part gives a student's method, or a ``ti.func`` of its own that calls this method, to ``rows``. If the answers are
random, it gives it to ``samples``, which calls it many times for each row. So no part needs a kernel of its own.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import taichi as ti

from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.teaching.base import Arrays

SEED = 5  # of the random numbers of all parts; the inputs of a part have a seed of their own
RANDOM = IndependentSampler()


@ti.func
def begin(row, call):
    """Begin the random numbers of one call."""
    RANDOM.start(ti.u32(SEED), row, 0, call)


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
    found = call_on_rows(function, inputs, names, answers, 1, numbers, None)
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
    return call_on_rows(function, inputs, names, answers, count, numbers, begin)


def call_on_rows(
    function: Callable,
    inputs: Arrays,
    names: Sequence[str],
    answers: Mapping[str, int],
    count: int,
    numbers: range,
    begins: Callable | None,
) -> Arrays:
    """What a function returns, ``count`` times for every row; ``begins`` is called before each call."""
    given = [inputs[name] for name in names]
    sizes = [a.shape[1] if a.ndim > 1 else 1 for a in given]
    widths = [size if a.dtype.kind == "f" else -size for a, size in zip(given, sizes, strict=True)]
    number = len(given[0]) if given else len(numbers)
    table = np.hstack([np.zeros((number, 0)), *(a.reshape(number, -1) for a in given)])
    found = Rows(function, widths, list(answers.values()), begins).calls(table, count, numbers.start)
    kinds = [np.int32 if width == WHOLE else np.float32 for width in answers.values()]
    return {name: array.astype(kind) for name, array, kind in zip(answers, found, kinds, strict=True)}
