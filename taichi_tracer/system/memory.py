"""Taichi fields that are freed together with their owner, and errors instead of crashes when they are gone."""

import weakref

import taichi as ti
from taichi.lang import impl

from taichi_tracer.system.errors import StaleSceneError
from taichi_tracer.system.runtime import ensure


class Lifetime:
    """Remembers the start of Taichi to which an object's fields belong. Fields of an earlier start must not be used."""

    def __init__(self) -> None:
        ensure()
        self._program = weakref.ref(impl.get_runtime().prog)

    def is_over(self) -> bool:
        """Whether Taichi was started again, or reset, since then."""
        program = self._program()
        return program is None or program is not impl.get_runtime().prog

    def check(self, what: str) -> None:
        """Raise a StaleSceneError if the fields of ``what`` are gone; using them would crash the process."""
        if self.is_over():
            raise StaleSceneError(
                f"this {what} was made before Taichi was initialised again, which freed its memory: make a new one"
            )


class Memory:
    """The fields of one owner, which are freed together with the owner.

    Taichi itself never frees fields, and has room for only 512 such groups. First make this object, then make the
    fields, place them in ``fields``, and call ``allocate``. No kernel can run in between.
    """

    def __init__(self) -> None:
        _free_orphans()
        self._lifetime = Lifetime()
        self.fields = ti.FieldsBuilder()
        self._tree = None

    def is_over(self) -> bool:
        """Whether Taichi was started again since then, or the memory was freed."""
        return self._tree is None or self._lifetime.is_over()

    def allocate(self) -> None:
        """Allocate the fields. After that, no more fields can be placed."""
        self._tree = self.fields.finalize()

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
            _orphans.append((self._lifetime, self._tree))


_orphans: list[tuple[Lifetime, object]] = []


def _free_orphans() -> None:
    """Free the memory of owners that no longer exist."""
    while _orphans:
        lifetime, tree = _orphans.pop()
        _destroy(tree, lifetime)


def _destroy(tree: object, lifetime: Lifetime) -> None:
    if not lifetime.is_over():
        impl.get_runtime().materialize()  # otherwise Taichi would still check fields that no kernel has used
        tree.destroy()
