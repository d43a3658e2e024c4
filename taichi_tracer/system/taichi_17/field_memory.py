"""The memory of Taichi's fields as numpy arrays: on a CPU, numpy reads and writes them without a kernel.

A kernel that only copies takes 0.1 s to translate and to load, in every new process, and copies for a millisecond. The
one kernel here tells where groups of fields are in memory, and is the smallest that there can be.
"""

import ctypes
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import taichi as ti
from taichi.lang.util import to_numpy_type

from taichi_tracer.system import direct

AT_ONCE = 16  # fields whose places one kernel tells; Taichi warns of loops with more than 32 static iterations


def use() -> None:
    """Let the package read and write fields in this way, from now on."""
    direct.places = sys.modules[__name__]


def root_addresses(fields: Sequence[Any]) -> list[int]:
    """For each field, the address at which the memory of its group begins: of all fields that were allocated with it.

    One kernel finds up to ``AT_ONCE`` of them.
    """
    found = np.zeros(len(fields), np.uint64)
    for first in range(0, len(fields), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        Addresses(fields[some]).find(found[some])
    return [int(address) - layout(components(f)[0])[0] for address, f in zip(found, fields, strict=True)]


def array_at(root: int, field: Any) -> np.ndarray:
    """The memory of a field: the array has the shape of the field, and for vectors and matrices theirs behind it.

    Args:
        root: one of the ``root_addresses``.
    """
    places = components(field)
    parts = {k: layout(places[k]) for k in {0, min(1, len(places) - 1), len(places) - 1}}
    offset, shape, strides = parts[0]
    kind = np.dtype(to_numpy_type(field.dtype))
    own = (field.n, field.m) if getattr(field, "m", 1) > 1 else (field.n,) if hasattr(field, "n") else ()
    step = parts[1][0] - offset if len(parts) > 1 else kind.itemsize
    if any(part[0] != offset + step * k for k, part in parts.items()):
        raise ValueError("the components of a field are not evenly spaced in memory")
    within = tuple(step * int(np.prod(own[k + 1 :])) for k in range(len(own)))
    shape, strides = (*shape, *own), (*strides, *within)
    size = kind.itemsize + sum((n - 1) * stride for n, stride in zip(shape, strides, strict=True))
    memory = (ctypes.c_ubyte * size).from_address(root + offset)
    return np.ndarray(shape, kind, memory, 0, strides)


def clear(root: int, field: Any) -> None:
    """Set the memory of a field to 0, and of all fields that share its cells; at the speed of the memory.

    Args:
        root: one of the ``root_addresses``.
    """
    offset, node = 0, components(field)[0].parent
    size = node.cell_size_bytes
    for count in extents(node).values():
        size *= count
    while node.parent is not None:
        offset, node = offset + node.offset_bytes_in_parent_cell, node.parent
    ctypes.memset(root + offset, 0, size)


def components(field: Any) -> list[Any]:
    """Taichi's places of the components of a field: one of a scalar field, n m of a field of matrices."""
    return [variable.ptr.snode() for variable in field.vars]


def layout(place: Any) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
    """Where a component is in memory, in bytes: its offset from the root, the shape of its field, and the strides."""
    shape = [place.get_shape_along_axis(k) for k in range(place.num_active_indices())]
    axes = [place.get_physical_index_position()[k] for k in range(len(shape))]
    strides, offset, node = dict.fromkeys(axes, 0), 0, place
    while node.parent is not None:
        offset += node.offset_bytes_in_parent_cell
        own, above = extents(node), extents(node.parent)
        stride = node.cell_size_bytes
        for axis in reversed(list(own)):
            length = own[axis] // above.get(axis, 1)
            if length > 1:
                if strides[axis] > 0:
                    raise ValueError("an axis of a field is divided into blocks")
                strides[axis] = stride
                stride *= length
        node = node.parent
    return offset, tuple(shape), tuple(strides[axis] for axis in axes)


def extents(node: Any) -> dict[int, int]:
    """Axis → how many cells there are along it, from the root to a node of Taichi's tree."""
    count = node.num_active_indices()
    return {node.get_physical_index_position()[k]: node.get_shape_along_axis(k) for k in range(count)}


@ti.data_oriented
class Addresses:
    """Tells where fields are in memory: the address of the first cell of each."""

    def __init__(self, fields: Sequence[Any]) -> None:
        self.fields, self.indices = tuple(fields), [len(field.shape) for field in fields]

    @ti.kernel
    def find(self, found: ti.types.ndarray(dtype=ti.u64, ndim=1)):
        """Write the addresses into an array of as many numbers."""
        for k, field in ti.static(enumerate(self.fields)):
            found[k] = ti.get_addr(field, [0] * ti.static(self.indices[k]))
