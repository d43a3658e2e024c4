"""Runs a function of kernels on every row of some arrays: checks and assignments need no kernels of their own."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import compile_time

WHOLE = 0  # the width of one whole number, of less than 24 bits; −2 is that of a vector of two


def columns_of(widths: Sequence[int]) -> list[tuple[int, int, Any]]:
    """(first place in a row, how many numbers, their type) of columns of a table."""
    sizes = [abs(width) or 1 for width in widths]
    return [(sum(sizes[:i]), size, ti.i32 if widths[i] <= WHOLE else float) for i, size in enumerate(sizes)]


@ti.data_oriented
class Rows:
    """A function that Python can call for all rows of some arrays at once. It is compiled once.

    Args:
        function: a ``ti.func``, or a method that is one. It returns one value, or a tuple with one for each answer.
        arguments, answers: the width of each: 1 is a real number, and 3 a vector of three; see ``WHOLE``.
        begin: a ``ti.func`` of the number of the row and of the call, before each call: for random numbers.
    """

    def __init__(
        self,
        function: Callable,
        arguments: Sequence[int],
        answers: Sequence[int],
        begin: Callable | None = None,
    ) -> None:
        self.function, self.begin, self.is_random = function, begin, begin is not None
        self.arguments, self.answers = columns_of(arguments), columns_of(answers)

    def __call__(self, *arrays: Any) -> Any:
        """The answers to each row, (n,) or (n, width) float64; one array if there is one answer.

        Args:
            arrays: (n,) or (n, width); a single number or vector is that of every row.
        """
        found = [answer[:, 0].astype(np.float64) for answer in self.calls(arrays)]
        return found[0] if len(found) == 1 else found

    def calls(self, arrays: Sequence[Any], count: int = 1, numbers: range = range(0)) -> list[np.ndarray]:
        """(n, count) or (n, count, width) answers of the function, called ``count`` times for each row.

        Args:
            arrays: as of ``__call__``. numbers: those of the rows, of a function without arguments.
        """
        columns = [np.reshape(a, (-1, size)) for a, (_, size, _) in zip(arrays, self.arguments, strict=True)]
        n = max(map(len, columns), default=len(numbers))
        table = np.hstack([np.zeros((n, 0)), *(np.broadcast_to(column, (n, column.shape[1])) for column in columns)])
        found = np.zeros((n, count, sum(size for _, size, _ in self.answers)), runtime.dtype())
        self._run(numbers.start, np.ascontiguousarray(table, runtime.dtype()), found)
        return [found[..., at : at + size] if size > 1 else found[..., at] for at, size, _ in self.answers]

    @ti.kernel
    def _run(self, first: ti.i32, table: ti.types.ndarray(ndim=2), found: ti.types.ndarray(ndim=3)):
        for i, j in ti.ndrange(found.shape[0], found.shape[1]):
            if ti.static(self.is_random):
                self.begin(first + i, j)
            answer = self.function(*[read(table, i, column) for column in ti.static(self.arguments)])
            if ti.static(len(self.answers) == 1):
                write(found, i, j, self.answers[0], answer)
            else:
                for k in ti.static(range(len(self.answers))):
                    write(found, i, j, self.answers[k], answer[k])


def bound(ask: Callable, *given: Any) -> Callable:
    """A function of kernels whose first arguments are objects of Python."""

    @compile_time
    def call(*arguments: Any) -> Any:
        return ask(*given, *arguments)

    return call


@ti.func
def read(table: ti.template(), i, column: ti.template()):
    """The number or the vector of a column in row i."""
    first, size, kind = ti.static(column)
    if ti.static(size > 1):
        return ti.Vector([ti.cast(table[i, first + k], kind) for k in range(size)])
    else:  # noqa: RET505 (without it, both would be compiled)
        return ti.cast(table[i, first], kind)


@ti.func
def write(found: ti.template(), i, j, column: ti.template(), value):
    """Write a number or a vector as call j of row i."""
    first, size, kind = ti.static(column)
    if ti.static(size > 1):
        for k in ti.static(range(size)):
            found[i, j, first + k] = ti.cast(value[k], kind)
    else:
        found[i, j, first] = ti.cast(value, kind)


def as_f32(values) -> np.ndarray:
    """The nearest f32 numbers, as float64."""
    return np.asarray(values, np.float32).astype(np.float64)


def separate(triangles) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3, 3) corners as a mesh whose triangles share no vertex."""
    vertices = as_f32(triangles).reshape(-1, 3)
    return vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)


def sphere(columns=16, rows=9, radius=1.0, centre=(0.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """A closed sphere of 2·columns·(rows − 1) triangles, fronts outside, poles on the y axis."""
    theta = np.linspace(0, np.pi, rows + 1)[1:-1, None]
    phi = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    ring = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta) + 0 * phi, -np.sin(theta) * np.sin(phi)], axis=-1)
    vertices = np.concatenate([[[0, 1, 0]], ring.reshape(-1, 3), [[0, -1, 0]]])
    # Ids of a grid of vertices, in which each pole is a whole row: b right of a, c and d below them.
    ids = np.vstack(
        [[0] * columns, 1 + np.arange(len(vertices) - 2).reshape(-1, columns), [len(vertices) - 1] * columns]
    )
    after = np.roll(ids, -1, axis=1)
    a, b, c, d = ids[:-1], after[:-1], ids[1:], after[1:]
    upper, lower = np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)
    middle = [half[1:-1].reshape(-1, 3) for half in (upper, lower)]
    faces = np.concatenate([lower[0], *middle, np.roll(upper[-1], -1, axis=1)])
    return as_f32(vertices * radius + np.asarray(centre)), faces


def soup(rng, count, size=0.3):
    """Random triangles in a unit cube."""
    centre = rng.uniform(-1, 1, (count, 1, 3))
    return separate(centre + rng.normal(size=(count, 3, 3)) * size)


def lattice(rng, count):
    """Triangles with small integer corners: many ties, shared edges and exact hits."""
    return separate(rng.integers(-2, 3, (count, 3, 3)))


SQUARE = (np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
