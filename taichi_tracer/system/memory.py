"""Fields that are freed with the object that owns them; touching them after Taichi was started again is an error."""

import weakref
from pathlib import Path

import taichi as ti
from taichi.lang import impl

from taichi_tracer.system.errors import InputError, StaleSceneError
from taichi_tracer.system.runtime import ensure

KEPT_FREE = 0.1  # share of the free memory that is left to everything else


def ask_for(needed: int, what: str) -> None:
    """Raise InputError where the machine has less free memory than is needed: Taichi would end the process.

    Args:
        needed: bytes. what: for the message.
    """
    free = free_bytes()
    if free is not None and needed > (1 - KEPT_FREE) * free:
        sizes = f"{needed / 1e9:.3g} GB of memory, and {free / 1e9:.3g} GB are free"
        raise InputError(f"{what} needs {sizes}: ask for less")


def free_bytes() -> int | None:
    """Bytes that this process can still allocate, by the machine and by its own limit; None where that is not known."""
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
    """Remembers which start of Taichi an object's fields belong to; touching fields of an earlier one would crash."""

    def __init__(self) -> None:
        ensure()
        self._program = weakref.ref(impl.get_runtime().prog)

    def is_over(self) -> bool:
        """Whether Taichi was started again, or reset, since."""
        program = self._program()
        return program is None or program is not impl.get_runtime().prog

    def check(self, what: str) -> None:
        """Raise instead of crashing when the fields of ``what`` are gone."""
        if self.is_over():
            raise StaleSceneError(
                f"this {what} was made before Taichi was initialised again, which freed its memory: make it anew"
            )


class Memory:
    """Fields of one owner, freed when the owner is: Taichi frees none by itself, and has room for 512 such groups.

    Make it first, then the fields, place them in ``fields``, and ``allocate``; no kernel can run in between. Where
    something can go wrong in between, ``with memory:`` allocates at the end, or forgets the fields: Taichi would let no
    kernel run any more.
    """

    def __init__(self) -> None:
        _free_orphans()
        self._lifetime = Lifetime()
        self.fields = ti.FieldsBuilder()
        self._tree = None

    def is_over(self) -> bool:
        """Whether Taichi was started again since, or the memory was freed."""
        return self._tree is None or self._lifetime.is_over()

    def allocate(self) -> None:
        """Make the fields usable; none can be placed afterwards."""
        self._tree = self.fields.finalize()

    def __enter__(self) -> ti.FieldsBuilder:
        return self.fields

    def __exit__(self, error, *_more) -> None:
        if error is None:
            self.allocate()
        else:
            impl.get_runtime().unfinalized_fields_builder.pop(self.fields, None)

    def check(self, what: str) -> None:
        """Raise StaleSceneError when Taichi was started again since, or the memory was freed."""
        self._lifetime.check(what)
        if self._tree is None:
            raise StaleSceneError(f"this {what} was destroyed: make it anew")

    def free(self) -> None:
        """Give the memory back now; the fields cannot be used afterwards."""
        tree, self._tree = self._tree, None
        if tree is not None:
            _destroy(tree, self._lifetime)

    def __del__(self) -> None:
        # Not freed here: the collector may run while Taichi compiles a kernel.
        if getattr(self, "_tree", None) is not None and _orphans is not None:  # None when the interpreter ends
            _orphans.append((self._lifetime, self._tree))


_orphans: list[tuple[Lifetime, object]] = []


def _free_orphans() -> None:
    """Free the memory whose owners are gone."""
    while _orphans:
        lifetime, tree = _orphans.pop()
        _destroy(tree, lifetime)


def _destroy(tree: object, lifetime: Lifetime) -> None:
    if not lifetime.is_over():
        impl.get_runtime().materialize()  # or Taichi would still check fields that no kernel has used
        tree.destroy()
