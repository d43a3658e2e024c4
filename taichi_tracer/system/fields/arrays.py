"""Fields whose numbers are in numpy's memory: kernels get them as arguments, so that one kernel serves every length.

The shape of a Taichi field is a part of each kernel that reads it: another mesh, or another size of the picture, would
compile all kernels again. The fields of a ``memory.Memory`` are therefore placed here, on a CPU. They are written as
everywhere in Taichi (``ti.field(float)``, ``builder.dense(ti.i, n).place(field)``, ``field[i]``), and numpy reads and
writes the same memory without a kernel. ``taichi_17.arguments`` makes an argument of each field that a kernel uses.

On a GPU, in debug mode, or without ``taichi_17``, they are Taichi's own fields, whose data kernels copy.
"""

import itertools
import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike
from taichi.lang import impl
from taichi.lang.field import Field, ScalarField
from taichi.lang.matrix import MatrixField
from taichi.lang.struct import StructField
from taichi.lang.util import to_numpy_type

from taichi_tracer.system.errors import InputError, StaleSceneError
from taichi_tracer.system.runtime import ensure

ALIGNMENT = 64  # bytes: the largest vector that a CPU reads at once
MOST_NUMBERS = (1 << 31) - 1  # numbers: kernels count in i32
LETTERS = "ijkl"
# Taichi's lists of axes, such as ``ti.ij``, whose elements do not say which axes they are: id of the list → numbers.
AXES = {
    id(getattr(ti, "".join(letters))): [LETTERS.index(letter) for letter in letters]
    for length in (1, 2, 3)
    for letters in itertools.combinations(LETTERS, length)
}
are_arguments = False  # whether ``taichi_17.arguments`` is in use


def use() -> None:
    """Let the package make fields in this way, from now on."""
    global are_arguments
    are_arguments = True


def are_possible() -> bool:
    """Whether kernels can get numpy's memory as arguments; debug mode checks the bounds of Taichi's own fields only."""
    return ensure().arch == "cpu" and are_arguments and not ti.cfg.debug


class Block:
    """A ``dense`` node of a tree of fields. Each field gets an array of its own, so that a block is only a shape.

    Args:
        placed: what the root has placed. counts: axis → how many cells there are along it, in all blocks together.
        constant: the axes whose count is a constant of the code.
    """

    def __init__(self, placed: list[Any], counts: dict[int, int], constant: frozenset[int]) -> None:
        self.placed, self.counts, self.constant = placed, counts, constant

    def dense(self, axes: Sequence[Any], counts: Sequence[int] | int) -> "Block":
        """A block in each cell of this one. In the cells of another block, its count is a constant if it has one axis.

        Args:
            axes: a list of Taichi's, such as ``ti.ij``. counts: how many cells there are along each, or one number for
                all.
        """
        counts = [counts] * len(axes) if isinstance(counts, (int, np.integer)) else counts
        own = {axis: int(count) for axis, count in zip(AXES[id(axes)], counts, strict=True)}
        if set(own) & set(self.counts):
            raise InputError("an axis of a field cannot be divided into blocks here")
        constant = frozenset(own) if self.counts and len(own) == 1 else frozenset()
        return Block(self.placed, self.counts | own, constant)

    def place(self, *fields: Any) -> "Block":
        """Give fields an element in each cell."""
        members = [one for field in fields for one in (field._members if isinstance(field, StructField) else [field])]
        for member in members:
            if type(member) not in (ScalarField, MatrixField) or member.vars[0].ptr.snode() is not None:
                raise InputError("only a field without a shape, which has not been placed yet, can be placed here")
            self.placed.append((member, dict(sorted(self.counts.items())), self.constant))
        return self


class Builder(Block):
    """The root of a tree of fields, in place of ``ti.FieldsBuilder``; its own fields have one element each."""

    def __init__(self) -> None:
        super().__init__([], {}, frozenset())

    def finalize(self) -> list["ArrayField"]:
        """Allocate the memory of all fields, which is 0. Returns the fields."""
        return [converted(*one) for one in self.placed]

    def forget(self) -> None:
        """Let Taichi forget the fields, which have no memory yet."""
        for field, _, _ in self.placed:
            forget(field)


def aligned(size: int) -> np.ndarray:
    """So many bytes, all of them 0, which begin at a multiple of ``ALIGNMENT``."""
    found = np.zeros(size + ALIGNMENT, np.uint8)
    return found[-found.ctypes.data % ALIGNMENT :][:size]


class ArrayField(Field):
    """What fields in numpy's memory have in place of the nodes of Taichi's tree.

    Attributes:
        array: the numbers, with the shape of the field, and for vectors and matrices theirs behind it; None if the
            memory was freed.
        constant: for each axis, whether its count is a constant of the code.
        kind: the type of its numbers. own: the shape of a vector or of a matrix, () of a number.
    """

    array: np.ndarray | None
    kind: Any
    own: tuple[int, ...]
    constant: list[bool]
    host_accessors: Any

    def numbers(self) -> np.ndarray:
        """``array``, or an error if the memory was freed."""
        if self.array is None:
            raise StaleSceneError("this field was destroyed together with its owner: make a new one")
        return self.array

    def free(self) -> None:
        """Let go of the numbers."""
        self.array = self.host_accessors = None

    @property
    def shape(self) -> tuple[int, ...]:
        """How many elements there are along each axis."""
        return self.numbers().shape[: len(self.constant)]

    @property
    def dtype(self) -> Any:
        """Taichi's type of the numbers."""
        return self.kind

    @property
    def _snode(self) -> Any:
        return SimpleNamespace(shape=self.numbers().shape[: len(self.constant)], _dtype=self.kind, _name="", ptr=self)

    def _initialize_host_accessors(self) -> None:
        if not self.host_accessors:
            self.host_accessors = [Accessor(self.numbers(), place) for place in np.ndindex(*self.own)]

    def to_numpy(self, dtype: Any = None) -> np.ndarray:
        """A copy of the numbers."""
        return self.numbers().astype(self.numbers().dtype if dtype is None else dtype)

    def from_numpy(self, numbers: ArrayLike) -> None:
        """Set all numbers."""
        numbers = np.asarray(numbers)
        if numbers.shape != self.numbers().shape and numbers.size != self.numbers().size:
            raise ValueError(f"ti.field shape {self.shape} does not match the numpy array shape {numbers.shape}")
        self.numbers()[...] = numbers.reshape(self.numbers().shape)

    def copy_from(self, other: Any) -> None:
        """Copy all numbers from another field of the same shape."""
        self.from_numpy(other.to_numpy())

    def __str__(self) -> str:
        return repr(self) if impl.inside_kernel() or self.array is None else str(self.array)


class Accessor:
    """Reads and writes one component of each element of a field, for Python.

    Args:
        array: the numbers of the field. place: the index of the component.
    """

    def __init__(self, array: np.ndarray, place: tuple[int, ...]) -> None:
        self.array, self.place = array, place
        self.axes = array.ndim - len(place)

    def getter(self, *key: int) -> Any:
        """The number at an index, which has zeros behind the axes of the field."""
        return self.array[self.index(key)].item()

    def setter(self, value: Any, *key: int) -> None:
        """Set the number at an index."""
        self.array[self.index(key)] = value

    def index(self, key: tuple[int, ...]) -> tuple[int, ...]:
        """Numpy's index of the component."""
        return (*key[: self.axes], *self.place)


class ScalarArray(ArrayField, ScalarField):
    """A field of numbers in numpy's memory."""

    def fill(self, value: Any) -> None:
        """Set all numbers."""
        if impl.inside_kernel():
            ScalarField.fill(self, value)
        else:
            self.numbers()[...] = value


class MatrixArray(ArrayField, MatrixField):
    """A field of vectors or of matrices in numpy's memory."""

    def fill(self, value: Any) -> None:
        """Set all vectors or matrices, to one number or to one of their kind."""
        if impl.inside_kernel():
            MatrixField.fill(self, value)
        else:
            self.numbers()[...] = np.asarray(value.to_list() if isinstance(value, ti.Matrix) else value)


def kind_of(field: Any) -> tuple[str, tuple[int, ...]]:
    """The type of a field's numbers, and the shape of a vector or of a matrix, () of a number."""
    own = (field.n, field.m)[: field.ndim] if isinstance(field, MatrixField) else ()
    return field.vars[0].ptr.get_dt().to_string(), own


def forget(field: Any) -> None:
    """Let Taichi forget a field that has no memory; otherwise it would ask for it before the next kernel."""
    runtime, own = impl.get_runtime(), {id(variable) for variable in field.vars}
    runtime.global_vars = [variable for variable in runtime.global_vars if id(variable) not in own]
    runtime.matrix_fields = [other for other in runtime.matrix_fields if other is not field]


def converted(field: Any, counts: dict[int, int], constant: frozenset[int]) -> ArrayField:
    """Make a field of Taichi's that has no memory an ``ArrayField``, in place, and give it memory.

    Args:
        counts: axis → how many elements there are. constant: the axes whose count is a constant of the code.
    """
    forget(field)
    name, field.own = kind_of(field)
    field.kind = getattr(ti, name)
    kind, shape = np.dtype(to_numpy_type(field.kind)), (*counts.values(), *field.own)
    if math.prod(shape) > MOST_NUMBERS:
        raise InputError(f"an array of {' x '.join(map(str, counts.values()))} elements is too large for a kernel")
    field.__class__ = MatrixArray if isinstance(field, MatrixField) else ScalarArray
    field.array = aligned(math.prod(shape) * kind.itemsize).view(kind).reshape(shape)
    field.constant = [axis in constant for axis in counts]
    return field
