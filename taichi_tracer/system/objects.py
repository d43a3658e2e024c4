"""Objects with kernels, whose attributes are read as those of every other object in Python.

Since any attribute may be a kernel, which must know its object when it is called, ``ti.data_oriented`` lets Python run
a function for every access to any attribute. A frame of a window reads some 400 of them, which takes half a
millisecond. Here, only a kernel has a function that is run when it is accessed, as methods and properties do.

Classes of other modules, also those that inherit from the package's, are what Taichi makes of them.
"""

from typing import Any

import taichi as ti
from taichi.lang import kernel_impl

PACKAGE = "taichi_tracer."
_taichi_data_oriented = ti.data_oriented


class BoundKernel:
    """A kernel in the body of a class: an object that is asked for it gets the kernel with this object."""

    def __init__(self, kernel: Any) -> None:
        self.kernel = kernel

    def __get__(self, owner: Any, cls: type | None = None) -> Any:
        if owner is None:
            return self.kernel
        bound = kernel_impl._BoundedDifferentiableMethod(owner, self.kernel)
        bound.__name__ = self.kernel.__name__
        return bound


def data_oriented(cls: type) -> type:
    """What ``ti.data_oriented`` is from now on. For classes of other modules, it is what it was before.

    A class of the package binds only kernels that are methods in its own body: none that are static or properties.
    """
    if not cls.__module__.startswith(PACKAGE):
        return _taichi_data_oriented(cls)

    def of_subclass(subclass: type, **words: Any) -> None:
        """What a class without a decorator inherits."""
        super(cls, subclass).__init_subclass__(**words)  # type: ignore[arg-type]
        if subclass.__module__.startswith(PACKAGE):
            bind_kernels(subclass)
        else:
            _taichi_data_oriented(subclass)

    bind_kernels(cls)
    cls._data_oriented = True  # type: ignore[attr-defined]  # the mark that Taichi looks for
    cls.__init_subclass__ = classmethod(of_subclass)  # type: ignore[assignment]
    return cls


def bind_kernels(cls: type) -> None:
    """Let the kernels in the body of a class be bound to its objects."""
    for name, value in list(vars(cls).items()):
        if getattr(value, "_is_wrapped_kernel", False) and value._is_classkernel:
            value._is_staticmethod = False  # as Taichi notes at each access
            setattr(cls, name, BoundKernel(value))


def read_attributes_directly() -> None:
    """Let ``ti.data_oriented`` be the one of this module, unless Taichi lacks what it needs."""
    if hasattr(kernel_impl, "_BoundedDifferentiableMethod"):
        ti.data_oriented = data_oriented
