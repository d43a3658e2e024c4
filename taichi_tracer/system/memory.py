"""Taichi fields that are freed together with their owner, and errors instead of crashes when they are gone.

On a CPU, numpy writes the fields (``direct``). For this, a kernel must tell where they are, and each such kernel takes
0.03 s to translate. Therefore small arrays wait until a kernel or Python could read a field: then one kernel tells the
places of all fields for which something waits. ``taichi_17`` sees to it that Taichi calls ``write_what_waits`` then.
"""

import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike
from taichi.lang import impl
from taichi.lang.util import to_numpy_type

from taichi_tracer.system import direct
from taichi_tracer.system.errors import InputError, StaleSceneError
from taichi_tracer.system.runtime import check_not_forked, ensure, is_forked

KEPT_FREE = 0.1  # the fraction of the free memory that is left for other uses
# Owners that no longer exist, and bytes of theirs, that may wait to be freed. When Taichi frees memory, it forgets all
# kernels, so that Python must read again every kernel that is still in use.
MOST_WAITING, MOST_BYTES_WAITING = 32, 1 << 27
LARGE = 1 << 22  # bytes: an array that is not copied, to be written later
MOST_WRITES = 100  # that wait at the same time


def ask_for(needed: int, what: str) -> None:
    """Raise an InputError if more memory is needed than is free. Without this check, Taichi would end the process.

    Args:
        needed: the memory in bytes. what: the name of what needs it, for the message.
    """
    free = free_bytes()
    if free is not None and needed > (1 - KEPT_FREE) * free and _orphans:
        _free_orphans()
        free = free_bytes()
    if free is not None and needed > (1 - KEPT_FREE) * free:
        sizes = f"{needed / 1e9:.3g} GB of memory, and {free / 1e9:.3g} GB are free"
        raise InputError(f"{what} needs {sizes}: ask for less")


def free_bytes() -> int | None:
    """The bytes that this process can still allocate, by the machine's and its own limit; None if this is unknown."""
    known = []
    meminfo = Path("/proc/meminfo")
    if meminfo.exists():
        lines = dict(line.split(":", 1) for line in meminfo.read_text().splitlines())
        known.append(int(lines["MemAvailable"].split()[0]) * 1024)
    try:
        import resource
    except ImportError:  # Windows
        return min(known, default=None)
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY:
        status = Path("/proc/self/statm")
        used = int(status.read_text().split()[0]) * resource.getpagesize() if status.exists() else 0
        known.append(max(0, limit - used))
    return min(known, default=None)


class Lifetime:
    """Remembers the start of Taichi to which an object's fields belong. Fields of an earlier start must not be used."""

    def __init__(self) -> None:
        ensure()
        self._program = weakref.ref(impl.get_runtime().prog)

    def is_over(self) -> bool:
        """Whether Taichi was started again, or reset, since then."""
        program = self._program()
        return is_forked() or program is None or program is not impl.get_runtime().prog

    def check(self, what: str) -> None:
        """Raise a StaleSceneError if the fields of ``what`` are gone; using them would crash the process."""
        check_not_forked()
        if self.is_over():
            raise StaleSceneError(
                f"this {what} was made before Taichi was initialised again, which freed its memory: make a new one"
            )


class Memory:
    """The fields of one owner, which are freed together with the owner.

    Taichi itself never frees fields, and has room for only 512 such groups. The memory of owners that no longer exist
    is freed when some of it has come together, because kernels must be read again afterwards.

    First make this object, then make the fields, place them in ``fields``, and call ``allocate``. No kernel can run in
    between. If an error can occur in between, use ``with memory:``. It allocates the fields at the end. After an error,
    it forgets them: otherwise no kernel could run any more.
    """

    def __init__(self) -> None:
        if len(_orphans) > MOST_WAITING or sum(size for _, _, size in _orphans) > MOST_BYTES_WAITING:
            _free_orphans()
        self._lifetime = Lifetime()
        self.fields = ti.FieldsBuilder()
        self._tree, self._bytes = None, 0
        self._root: int | None = None  # the address of the memory, if it was asked for

    def is_over(self) -> bool:
        """Whether Taichi was started again since then, or the memory was freed."""
        return self._tree is None or self._lifetime.is_over()

    def allocate(self) -> None:
        """Allocate the fields. After that, no more fields can be placed."""
        tree: Any = self.fields.finalize()
        self._tree = tree
        self._bytes = impl.get_runtime().prog.get_snode_root(tree.id).cell_size_bytes

    def array(self, field: Any) -> np.ndarray:
        """The memory of one of these fields as an array, see ``direct``; only where ``direct.is_possible``.

        It must not be used any more when the memory was freed.
        """
        return direct.places.array_at(self._root_of(field), field)

    def _root_of(self, field: Any) -> int:
        self.check("field")
        if self._root is None:
            write_what_waits((self, field))
        assert self._root is not None
        return self._root

    def write(self, field: Any, numbers: ArrayLike) -> None:
        """Set all numbers of one of these fields; ``numbers`` has the shape of ``field.to_numpy()``."""
        if direct.is_possible():
            self.put(field, ..., np.asarray(numbers))
        else:
            field.from_numpy(np.asarray(numbers, to_numpy_type(field.dtype), order="C"))

    def put(self, field: Any, rows: Any, numbers: np.ndarray) -> None:
        """Set some rows of one of these fields, now or before anything can read them; where ``direct.is_possible``.

        Args:
            rows: an index of ``array``. numbers: for ``array[rows]``.
        """
        if self._root is not None or numbers.nbytes > LARGE:
            self.array(field)[rows] = numbers
        else:
            self._let_wait(Waiting(self, field, rows, numbers.copy()))

    def clear(self, field: Any) -> None:
        """Set a field to 0, and all fields that were placed together with it; only where ``direct.is_possible``."""
        if self._root is not None:
            direct.places.clear(self._root_of(field), field)
        else:
            self._let_wait(Waiting(self, field))

    def _let_wait(self, waiting: "Waiting") -> None:
        self.check("field")
        _waiting.append(waiting)
        if len(_waiting) > MOST_WRITES:
            write_what_waits()

    def read(self, field: Any) -> np.ndarray:
        """``field.to_numpy()`` of one of these fields."""
        return self.array(field).copy() if direct.is_possible() else field.to_numpy()

    def __enter__(self) -> ti.FieldsBuilder:
        return self.fields

    def __exit__(self, error, *_more) -> None:
        if error is None:
            self.allocate()
        else:
            impl.get_runtime().unfinalized_fields_builder.pop(self.fields, None)

    def check(self, what: str) -> None:
        """Raise a StaleSceneError if Taichi was started again since then, or the memory was freed."""
        self._lifetime.check(what)
        if self._tree is None:
            raise StaleSceneError(f"this {what} was destroyed: make a new one")

    def free(self) -> None:
        """Free the memory now. The fields cannot be used afterwards."""
        tree, self._tree = self._tree, None
        if tree is not None:
            _destroy(tree, self._lifetime)

    def __del__(self) -> None:
        # The fields are not freed here, because Python may call this method while Taichi compiles a kernel.
        if getattr(self, "_tree", None) is not None and _orphans is not None:  # it is None when Python exits
            _orphans.append((self._lifetime, self._tree, self._bytes))


@dataclass
class Waiting:
    """Something that is to be written before anybody reads it.

    Attributes:
        owner: the owner of the memory, which is not freed before.
        field: one of its fields. rows: an index of the array that is its memory. numbers: for these rows; None sets the
            field, and all that were placed together with it, to 0.
    """

    owner: Memory
    field: Any
    rows: Any = None
    numbers: np.ndarray | None = None

    def write(self) -> None:
        """Write it, unless the memory was freed."""
        if self.owner.is_over():
            return
        if self.numbers is None:
            self.owner.clear(self.field)
        else:
            self.owner.put(self.field, self.rows, self.numbers)


_waiting: list[Waiting] = []
_is_asking = False  # whether the kernel runs that tells places


def write_what_waits(*also: tuple[Memory, Any]) -> None:
    """Write what waits: find the places of all fields for which something waits, and of some more, and write there.

    Nothing happens if nothing waits, or if this was called by the kernel that tells places.

    Args:
        also: owners of memory whose place is to be found, each with one of its fields.
    """
    global _is_asking
    if _is_asking or not (_waiting or also):
        return
    now, owners = list(_waiting), {id(one): (one, field) for one, field in also}
    for waiting in now:
        if not waiting.owner.is_over():
            owners[id(waiting.owner)] = waiting.owner, waiting.field
    unknown = [(one, field) for one, field in owners.values() if one._root is None]
    if unknown:
        _is_asking = True
        try:
            roots = direct.places.root_addresses([field for _, field in unknown])
        finally:
            _is_asking = False
        for (one, _), root in zip(unknown, roots, strict=True):
            one._root = root
    del _waiting[: len(now)]  # not earlier: if the kernel is interrupted, they wait on
    for waiting in now:
        waiting.write()


_orphans: list[tuple[Lifetime, Any, int]] = []


def _free_orphans() -> None:
    """Free the memory of owners that no longer exist."""
    while _orphans:
        lifetime, tree, _ = _orphans.pop()
        _destroy(tree, lifetime)


def _destroy(tree: Any, lifetime: Lifetime) -> None:
    if not lifetime.is_over():
        impl.get_runtime().materialize()  # otherwise Taichi would still check fields that no kernel has used
        tree.destroy()
