"""Taichi fields that are freed together with their owner, and errors instead of crashes when they are gone.

On a CPU, the fields are in numpy's memory (``arrays``), which Python frees. Elsewhere they are Taichi's own.
"""

import weakref
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike
from taichi.lang import impl
from taichi.lang.util import to_numpy_type

from taichi_tracer.system.errors import InputError, StaleSceneError
from taichi_tracer.system.fields import arrays
from taichi_tracer.system.runtime import check_not_forked, ensure, is_forked
from taichi_tracer.system.threads import is_starter

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
    if free is not None and needed > (1 - KEPT_FREE) * free and _orphans:
        _free_orphans()
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

    Taichi itself never frees its own fields, and has room for only 512 such groups. The memory of owners that no longer
    exist is freed when some of it has come together, because kernels must be read again afterwards.

    First make this object, then make the fields, place them in ``fields``, and call ``allocate``. No kernel can run in
    between. If an error can occur in between, use ``with memory:``. It allocates the fields at the end. After an error,
    it forgets them: otherwise no kernel could run any more.
    """

    def __init__(self) -> None:
        if len(_orphans) > MOST_WAITING or sum(size for _, _, size in _orphans) > MOST_BYTES_WAITING:
            _free_orphans()
        self._lifetime = Lifetime()
        if not (arrays.are_possible() or is_starter()):
            raise InputError("on this backend, scenes and renderers are made in the thread that started Taichi")
        self.has_arrays = arrays.are_possible()
        self.fields: Any = arrays.Builder() if self.has_arrays else ti.FieldsBuilder()
        self._tree: Any = None  # of Taichi's fields; or the list of those in numpy's memory
        self._bytes = 0

    def is_over(self) -> bool:
        """Whether Taichi was started again since then, or the memory was freed."""
        return self._tree is None or self._lifetime.is_over()

    def allocate(self) -> None:
        """Allocate the fields. After that, no more fields can be placed."""
        self._tree = self.fields.finalize()
        if not self.has_arrays:
            self._bytes = impl.get_runtime().prog.get_snode_root(self._tree.id).cell_size_bytes

    def array(self, field: Any) -> np.ndarray:
        """The memory of one of these fields as an array; only if this ``has_arrays``."""
        self.check("field")
        return field.numbers()

    def write(self, field: Any, numbers: ArrayLike) -> None:
        """Set all numbers of one of these fields; ``numbers`` has the shape of ``field.to_numpy()``."""
        if self.has_arrays:
            self.array(field)[...] = numbers
        else:
            field.from_numpy(np.asarray(numbers, to_numpy_type(field.dtype), order="C"))

    def clear(self, field: Any) -> None:
        """Set all numbers of one of these fields to 0."""
        self.check("field")
        if self.has_arrays:
            self.array(field)[...] = 0
        else:
            field.fill(0)

    def read(self, field: Any) -> np.ndarray:
        """``field.to_numpy()`` of one of these fields."""
        return self.array(field).copy() if self.has_arrays else field.to_numpy()

    def __enter__(self) -> Any:
        return self.fields

    def __exit__(self, error, *_more) -> None:
        if error is None:
            self.allocate()
        elif isinstance(self.fields, arrays.Builder):
            self.fields.forget()
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
        if self.has_arrays:
            for field in tree or ():
                field.free()
        elif tree is not None:
            _destroy(tree, self._lifetime)

    def __del__(self) -> None:
        # The fields are not freed here, because Python may call this method while Taichi compiles a kernel.
        is_own = getattr(self, "_tree", None) is not None and not self.has_arrays
        if is_own and _orphans is not None:
            _orphans.append((self._lifetime, self._tree, self._bytes))


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
