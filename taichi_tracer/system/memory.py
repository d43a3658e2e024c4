"""Taichi fields that are freed together with their owner, and errors instead of crashes when they are gone.

On a CPU, the fields are in numpy's memory (``arrays``), which Python frees. Elsewhere they are Taichi's own.
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

from taichi_tracer.system import arrays
from taichi_tracer.system.errors import InputError, StaleSceneError
from taichi_tracer.system.runtime import check_not_forked, ensure, is_forked
from taichi_tracer.system.threads import is_starter

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

    Taichi itself never frees its own fields, and has room for only 512 such groups. The memory of owners that no longer
    exist is freed when some of it has come together, because kernels must be read again afterwards.

    First make this object, then make the fields, place them in ``fields``, and call ``allocate``. No kernel can run in
    between. If an error can occur in between, use ``with memory:``. It allocates the fields at the end. After an error,
    it forgets them: otherwise no kernel could run any more.

    Args:
        scratch: a name, if only kernels use the fields, and each kernel anew. The fields are Taichi's own then, also on
            a CPU: LLVM makes faster code of them, and their shapes depend on the machine and not on the scene. All
            owners that give the same name and place the same fields share them, and therefore also kernels; ``claim``
            tells whether another one has used them.
    """

    def __init__(self, scratch: str = "") -> None:
        if len(_orphans) > MOST_WAITING or sum(size for _, _, size in _orphans) > MOST_BYTES_WAITING:
            _free_orphans()
        self._lifetime = Lifetime()
        scratch = scratch if is_starter() else ""
        if not (arrays.are_possible() or is_starter()):
            raise InputError("on this backend, scenes and renderers are made in the thread that started Taichi")
        self.scratch, self._shared, self._token = scratch, Shared(), object()
        self.has_arrays = not scratch and arrays.are_possible()
        self.fields: Any = arrays.Builder() if self.has_arrays or scratch else ti.FieldsBuilder()
        self._tree: Any = None  # of Taichi's fields; or the list of those in numpy's memory
        self._bytes = 0

    def is_over(self) -> bool:
        """Whether Taichi was started again since then, or the memory was freed."""
        return self._tree is None or self._lifetime.is_over()

    def allocate(self) -> None:
        """Allocate the fields. After that, no more fields can be placed."""
        if self.scratch:
            self._borrow()
            return
        self._tree = self.fields.finalize()
        if not self.has_arrays:
            self._bytes = impl.get_runtime().prog.get_snode_root(self._tree.id).cell_size_bytes

    def _borrow(self) -> None:
        """Use the fields that another owner has made, or make them."""
        key = self.scratch, self.fields.form()
        there, own = _scratch.get(key), list(self.fields.fields())
        if there is not None and not there.lifetime.is_over():
            self._shared = there
            self.fields.forget()
            for field, other in zip(own, there.fields, strict=True):
                vars(field).update(vars(other))
        else:
            self._shared = _scratch[key] = Shared(self._lifetime, self.fields.in_tree(), own)
        self._tree = self._shared.tree

    def claim(self) -> None:
        """Say that from now on these fields hold what this owner lets kernels write."""
        self._shared.user = self._token

    def is_claimed(self) -> bool:
        """Whether no other owner that shares these fields has claimed them since this one did."""
        return not self.scratch or self._shared.user is self._token

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
        elif tree is not None and not self.scratch:
            _destroy(tree, self._lifetime)

    def __del__(self) -> None:
        # The fields are not freed here, because Python may call this method while Taichi compiles a kernel.
        is_own = getattr(self, "_tree", None) is not None and not self.has_arrays and not self.scratch
        if is_own and _orphans is not None:
            _orphans.append((self._lifetime, self._tree, self._bytes))


@dataclass
class Shared:
    """Fields that several owners share.

    Attributes:
        lifetime: the start of Taichi to which they belong. tree: Taichi's tree of them. fields: in the order of places.
        user: the owner that has claimed them last.
    """

    lifetime: Any = None
    tree: Any = None
    fields: Any = ()
    user: Any = None


_scratch: dict[tuple[str, Any], Shared] = {}  # by the name and the form of the fields
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
