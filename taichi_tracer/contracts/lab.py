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
        columns = [np.reshape(a, (-1, size)) for a, (_, size, _) in zip(arrays, self.arguments, strict=True)]
        count = max(map(len, columns))
        table = np.hstack([np.broadcast_to(column, (count, column.shape[1])) for column in columns])
        found = [answer[:, 0].astype(np.float64) for answer in self.calls(table)]
        return found[0] if len(found) == 1 else found

    def calls(self, table: np.ndarray, count: int = 1, first: int = 0) -> list[np.ndarray]:
        """(n, count) or (n, count, width) answers of the function, called ``count`` times for each row of a table.

        Args:
            table: (n, k) the arguments side by side. first: the number of its first row.
        """
        found = np.zeros((len(table), count, sum(size for _, size, _ in self.answers)), runtime.dtype())
        self._run(first, np.ascontiguousarray(table, runtime.dtype()), found)
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


def sphere(columns=16, rows=9, radius=1.0, centre=(0, 0, 0)):
    """A closed sphere with its poles on the y axis; 2·columns·(rows − 1) triangles, fronts outside."""
    import trimesh  # here, because it takes a second, and ``check`` needs no sphere

    made = trimesh.creation.uv_sphere(radius, count=[rows, columns // 2])
    return made.vertices[:, [1, 2, 0]] + np.asarray(centre, float), made.faces.astype(np.int32)


def soup(rng, count, size=0.3):
    """Random triangles in a unit cube."""
    centre = rng.uniform(-1, 1, (count, 1, 3))
    vertices = (centre + rng.normal(size=(count, 3, 3)) * size).reshape(-1, 3)
    return vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def lattice(rng, count):
    """Triangles with small integer corners: many ties, shared edges and exact hits."""
    vertices = rng.integers(-2, 3, (3 * count, 3)).astype(float)
    return vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


SQUARE = (np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
