"""Memory of Taichi's fields: allocated and freed with its owner, and written from numpy at once.

**In numpy's memory.** The shape of a Taichi field is a part of each kernel that reads it: another mesh, or another size
of the picture, would compile all kernels again. On a CPU, fields are therefore placed in numpy's memory, and kernels
get them as arguments, so that one kernel serves every length. They are written as everywhere in Taichi
(``ti.field(float)``, ``builder.dense(ti.i, n).place(field)``, ``field[i]``), and numpy reads and writes the same memory
without a kernel. ``taichi_17.arguments`` makes an argument of each field that a kernel uses. On a GPU, in debug mode,
or without the patches, they are Taichi's own fields, whose data kernels copy.

**Freed.** The fields of a ``Memory`` are freed together with their owner. Reading them afterwards is an error, and ends
no process.

**Numbers.** A number in an attribute, such as ``self.max_bounces``, becomes a constant of every kernel that reads it,
and another number another kernel. Of a ``varying`` number, the kernel gets the value at each launch: ``self.width`` is
then an argument, without a word in the kernel. In Python and in ``ti.static`` it is the usual number.
"""

import itertools
import math
import weakref
from collections.abc import Callable, Hashable, Sequence
from pathlib import Path
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

from taichi_tracer.system import runtime
from taichi_tracer.system.compile_time import is_starter
from taichi_tracer.system.errors import InputError, StaleSceneError
from taichi_tracer.system.runtime import check_not_forked, ensure


def recent(kept: dict[Hashable, Any], most: int, key: Hashable, make: Callable[[], Any]) -> Any:
    """What was made for a key, or is made now; the ``most`` that were asked for last are kept."""
    kept[key] = found = kept.pop(key, None) or make()
    if len(kept) > most:
        del kept[next(iter(kept))]
    return found


# ── numbers ──


class VaryingInt(int):
    """A whole number that kernels get as an argument."""


class VaryingFloat(float):
    """A real number that kernels get as an argument."""


VARYING = (VaryingInt, VaryingFloat)


def varying(value: Any) -> Any:
    """A number, or a tuple of such, in the form that kernels get as an argument.

    Assign it to an attribute of an object that kernels read. The kernels see what the attribute is when they start.
    """
    if isinstance(value, tuple):
        return tuple(varying(one) for one in value)
    return VaryingFloat(value) if isinstance(value, float) else VaryingInt(value)


# ── fields in numpy's memory ──


ALIGNMENT = 64  # bytes: the largest vector that a CPU reads at once
MOST_NUMBERS = (1 << 31) - 1  # numbers: kernels count in i32
LETTERS = "ijkl"
# Taichi's lists of axes, such as ``ti.ij``, whose elements do not say which axes they are: id of the list → numbers.
AXES = {
    id(getattr(ti, "".join(letters))): [LETTERS.index(letter) for letter in letters]
    for length in (1, 2, 3)
    for letters in itertools.combinations(LETTERS, length)
}


def arrays_are_possible() -> bool:
    """Whether kernels can get numpy's memory as arguments; debug mode checks the bounds of Taichi's own fields only."""
    return ensure().arch == "cpu" and not runtime.patches() and not ti.cfg.debug


class Block:
    """A ``dense`` node of a tree of fields. Each field gets an array of its own, so that a block is only a shape.

    Args:
        placed: all fields of the tree. counts: axis → how many cells there are along it, in all blocks together.
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
        constant = frozenset(own) if self.counts and len(own) == 1 else frozenset()
        return Block(self.placed, self.counts | own, constant)

    def place(self, *fields: Any) -> "Block":
        """Give fields an element in each cell, which is 0, and let them be ``ArrayField``."""
        members = [one for field in fields for one in (field._members if isinstance(field, StructField) else [field])]
        for member in members:
            convert(member, dict(sorted(self.counts.items())), self.constant)
            self.placed.append(member)
        return self


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

    @property
    def _snode(self) -> Any:
        """What Taichi asks for the shape and the type."""
        return SimpleNamespace(shape=self.numbers().shape[: len(self.constant)], _dtype=self.kind, _name="", ptr=self)

    def _initialize_host_accessors(self) -> None:
        if not self.host_accessors:
            numbers = self.numbers().reshape(*self.shape, math.prod(self.own))
            self.host_accessors = [Accessor(numbers[..., k]) for k in range(numbers.shape[-1])]

    def to_numpy(self, dtype: Any = None) -> np.ndarray:
        """A copy of the numbers."""
        return self.numbers().astype(self.numbers().dtype if dtype is None else dtype)

    def from_numpy(self, numbers: ArrayLike) -> None:
        """Set all numbers."""
        numbers = np.asarray(numbers)
        if numbers.shape != self.numbers().shape and numbers.size != self.numbers().size:
            raise ValueError(f"ti.field shape {self.shape} does not match the numpy array shape {numbers.shape}")
        self.numbers()[...] = numbers.reshape(self.numbers().shape)

    def fill(self, value: Any) -> None:
        """Set all numbers, vectors or matrices, to one number or to one of their kind."""
        if impl.inside_kernel():
            super().fill(value)
        else:
            self.numbers()[...] = np.asarray(value.to_list() if isinstance(value, ti.Matrix) else value)

    def copy_from(self, other: Any) -> None:
        """Copy all numbers from another field of the same shape."""
        self.from_numpy(other.to_numpy())


class Accessor:
    """Reads and writes one component of each element of a field, for Python.

    Args:
        component: the numbers of this component, an array with the axes of the field.
    """

    def __init__(self, component: np.ndarray) -> None:
        self.component = component

    def getter(self, *key: int) -> Any:
        """The number at an index, which has zeros behind the axes of the field."""
        return self.component[key[: self.component.ndim]].item()

    def setter(self, value: Any, *key: int) -> None:
        """Set the number at an index."""
        self.component[key[: self.component.ndim]] = value


class ScalarArray(ArrayField, ScalarField):
    """A field of numbers in numpy's memory."""


class MatrixArray(ArrayField, MatrixField):
    """A field of vectors or of matrices in numpy's memory."""


def forget(field: Any) -> None:
    """Let Taichi forget a field that has no memory; otherwise it would ask for it before the next kernel."""
    runtime, own = impl.get_runtime(), {id(variable) for variable in field.vars}
    runtime.global_vars = [variable for variable in runtime.global_vars if id(variable) not in own]
    runtime.matrix_fields = [other for other in runtime.matrix_fields if other is not field]


def convert(field: Any, counts: dict[int, int], constant: frozenset[int]) -> None:
    """Make a field of Taichi's that has no memory an ``ArrayField``, in place, and give it memory.

    Args:
        counts: axis → how many elements there are. constant: the axes whose count is a constant of the code.
    """
    forget(field)
    field.own = (field.n, field.m)[: field.ndim] if isinstance(field, MatrixField) else ()
    field.kind = getattr(ti, field.vars[0].ptr.get_dt().to_string())
    kind, shape = np.dtype(to_numpy_type(field.kind)), (*counts.values(), *field.own)
    if math.prod(shape) > MOST_NUMBERS:
        raise InputError(f"an array of {' x '.join(map(str, counts.values()))} elements is too large for a kernel")
    field.__class__ = MatrixArray if isinstance(field, MatrixField) else ScalarArray
    field.array = aligned(math.prod(shape) * kind.itemsize).view(kind).reshape(shape)
    field.constant = [axis in constant for axis in counts]


# ── fields that are freed with their owner ──


MEMINFO = Path("/proc/meminfo")  # of Linux
KEPT_FREE = 0.1  # the fraction of the free memory that is left for other uses
# Owners that no longer exist, and bytes of theirs, that may wait to be freed. When Taichi frees memory, it forgets all
# kernels, so that Python must read again every kernel that is still in use.
MOST_WAITING, MOST_BYTES_WAITING = 32, 1 << 27


def ask_for(needed: int, what: str) -> None:
    """Raise an InputError if more memory is needed than is free. Without this check, Taichi would end the process.

    Args:
        needed: the memory in bytes. what: the name of what needs it, for the message.
    """
    free = free_bytes()
    if free is not None and needed > (1 - KEPT_FREE) * free:
        sizes = f"{needed / 1e9:.3g} GB of memory, and {free / 1e9:.3g} GB are free"
        raise InputError(f"{what} needs {sizes}: ask for less")


def free_bytes() -> int | None:
    """The bytes of memory that are free on this machine; None if this is unknown, as it is outside of Linux."""
    if not MEMINFO.exists():
        return None
    lines = dict(line.split(":", 1) for line in MEMINFO.read_text().splitlines())
    return int(lines["MemAvailable"].split()[0]) * 1024


def is_over(program: "weakref.ref[Any]") -> bool:
    """Whether Taichi was started again, or reset, since a program of Taichi was the one that runs."""
    return runtime.is_forked or program() is None or program() is not impl.get_runtime().prog


class Memory:
    """The fields of one owner, which are freed together with the owner.

    Taichi itself never frees its own fields, and has room for only 512 such groups. The memory of owners that no longer
    exist is freed when some of it has come together, because kernels must be read again afterwards.

    First make this object, then make the fields, place them in ``fields``, and call ``allocate``. No kernel can run in
    between.
    """

    def __init__(self) -> None:
        if len(_orphans) > MOST_WAITING or sum(size for *_, size in _orphans) > MOST_BYTES_WAITING:
            while _orphans:
                _destroy(*_orphans.pop())
        ensure()
        self._program = weakref.ref(impl.get_runtime().prog)  # a program has fields of its own
        if not (arrays_are_possible() or is_starter()):
            raise InputError("on this backend, scenes and renderers are made in the thread that started Taichi")
        self.has_arrays = arrays_are_possible()
        self._arrays: list[Any] = []  # the fields in numpy's memory
        self.fields: Any = Block(self._arrays, {}, frozenset()) if self.has_arrays else ti.FieldsBuilder()
        self._tree: Any = None  # what ``fields`` made when they were allocated
        self._bytes = 0

    def is_over(self) -> bool:
        """Whether Taichi was started again since then, or the memory was freed."""
        return self._tree is None or is_over(self._program)

    def allocate(self) -> None:
        """Allocate the fields. After that, no more fields can be placed."""
        self._tree = self.fields if self.has_arrays else self.fields.finalize()
        if not self.has_arrays:
            self._bytes = impl.get_runtime().prog.get_snode_root(self._tree.id).cell_size_bytes

    def write(self, field: Any, numbers: ArrayLike) -> None:
        """Set the numbers of one of these fields: all, as ``field.to_numpy()`` has them, or those of its first rows."""
        self.check("field")
        numbers = np.asarray(numbers, to_numpy_type(field.dtype), order="C")
        if field.shape and len(numbers) < field.shape[0]:
            numbers = np.pad(numbers, [(0, field.shape[0] - len(numbers)), *[(0, 0)] * (numbers.ndim - 1)])
        field.from_numpy(numbers)

    def clear(self, field: Any) -> None:
        """Set all numbers of one of these fields to 0."""
        self.check("field")
        field.fill(0)

    def read(self, field: Any) -> np.ndarray:
        """``field.to_numpy()`` of one of these fields."""
        self.check("field")
        return field.to_numpy()

    def check(self, what: str) -> None:
        """Raise a StaleSceneError if Taichi was started again since then, or the memory was freed."""
        check_not_forked()
        if is_over(self._program):
            raise StaleSceneError(
                f"this {what} was made before Taichi was initialised again, which freed its memory: make a new one"
            )
        if self._tree is None:
            raise StaleSceneError(f"this {what} was destroyed: make a new one")

    def free(self) -> None:
        """Free the memory now. The fields cannot be used afterwards."""
        tree, self._tree = self._tree, None
        for field in self._arrays:
            field.array = field.host_accessors = None
        if tree is not None and not self.has_arrays:
            _destroy(self._program, tree, self._bytes)

    def __del__(self) -> None:
        # The fields are not freed here, because Python may call this method while Taichi compiles a kernel.
        is_own = getattr(self, "_tree", None) is not None and not self.has_arrays
        if is_own and _orphans is not None:
            _orphans.append((self._program, self._tree, self._bytes))


# The program, the tree and the bytes of owners that no longer exist.
_orphans: list[tuple["weakref.ref[Any]", Any, int]] = []


def _destroy(program: "weakref.ref[Any]", tree: Any, _bytes: int) -> None:
    if not is_over(program):
        impl.get_runtime().materialize()  # otherwise Taichi would still check fields that no kernel has used
        tree.destroy()


# ── arrays that are copied into fields ──


def filled(*arrays: np.ndarray, indices: int = 1) -> tuple[Memory, list[Any]]:
    """The memory of new fields with these numbers, and the fields: of i32, or of the running precision.

    Args:
        arrays: one for each field; those of equal length stand side by side in memory. Where one has no rows, its
            field has one, which is 0.
        indices: how many of their axes, 1 or 2, fields have as indices; a further axis has the components of vectors.
    """
    memory, blocks, made = Memory(), {}, []
    for array in arrays:
        kind = ti.i32 if np.issubdtype(array.dtype, np.integer) else float
        made.append(ti.field(kind) if array.ndim == indices else ti.Vector.field(array.shape[-1], kind))
        counts = tuple(max(1, count) for count in array.shape[:indices])
        if counts not in blocks:
            blocks[counts] = memory.fields.dense(ti.i if indices == 1 else ti.ij, counts)
        blocks[counts].place(made[-1])
    memory.allocate()
    for field, array in zip(made, arrays, strict=True):
        memory.write(field, array)
    return memory, made
