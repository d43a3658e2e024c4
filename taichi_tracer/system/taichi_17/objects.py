"""Objects with kernels, whose attributes are read as those of every other object in Python.

Since any attribute may be a kernel, which must know its object when it is called, ``ti.data_oriented`` lets Python run
a function for every access to any attribute. A frame of a window reads some 400 of them, which takes half a
millisecond. Here, only a kernel has a function that is run when it is accessed, as methods and properties do.

Classes of other modules, also those that inherit from the package's, are what Taichi makes of them.
"""

import sys
from collections.abc import Callable
from typing import Any

from taichi.lang import kernel_impl

PACKAGE = "taichi_tracer."
TAICHIS_WAY = "data_oriented.<locals>._getattr"  # the function that Taichi lets Python run for each access


class BoundKernel:
    """A kernel in the body of a class: an object that is asked for it gets the kernel with this object."""

    def __init__(self, kernel: Any) -> None:
        self.bound_kernel = kernel

    def __get__(self, owner: Any, cls: type | None = None) -> Any:
        if owner is None:
            return self.bound_kernel
        bound = kernel_impl._BoundedDifferentiableMethod(owner, self.bound_kernel)
        bound.__name__ = self.bound_kernel.__name__
        return bound


def binding_kernels(usual: Callable[[type], type]) -> Callable[[type], type]:
    """``ti.data_oriented``. For classes of other modules, it is what it was before.

    A class of the package binds only kernels that are methods in its own body: none that are static or properties.
    """

    def data_oriented(cls: type) -> type:
        return made_direct(cls, usual) if cls.__module__.startswith(PACKAGE) else usual(cls)

    for cls in classes_of_package():
        made_direct(cls, usual)
        for subclass in subclasses(cls):
            if subclass.__module__.startswith(PACKAGE):
                bind_kernels(subclass)
            elif "__getattribute__" not in vars(subclass):
                usual(subclass)
    return data_oriented


def made_direct(cls: type, usual: Callable[[type], type]) -> type:
    """A class of the package, and classes that will inherit from it without a decorator of their own."""

    def of_subclass(subclass: type, **words: Any) -> None:
        """What a class without a decorator inherits."""
        super(cls, subclass).__init_subclass__(**words)  # type: ignore[arg-type]
        if subclass.__module__.startswith(PACKAGE):
            bind_kernels(subclass)
        else:
            usual(subclass)

    if takes_the_detour(cls):
        del cls.__getattribute__
    bind_kernels(cls)
    cls._data_oriented = True  # type: ignore[attr-defined]  # the mark that Taichi looks for
    cls.__init_subclass__ = classmethod(of_subclass)  # type: ignore[assignment]
    return cls


def classes_of_package() -> list[type]:
    """Every class of the package's modules to which ``ti.data_oriented`` was applied before."""
    modules = [module for name, module in list(sys.modules.items()) if name.startswith(PACKAGE)]
    values = [value for module in modules for value in vars(module).values()]
    return list({value: None for value in values if isinstance(value, type) and takes_the_detour(value)})


def takes_the_detour(cls: type) -> bool:
    """Whether the class is one of the package for which Python runs Taichi's function at each access."""
    way = vars(cls).get("__getattribute__")
    return cls.__module__.startswith(PACKAGE) and getattr(way, "__qualname__", "") == TAICHIS_WAY


def subclasses(cls: type) -> set[type]:
    """All classes that inherit from a class."""
    own: set[type] = set(cls.__subclasses__())
    return own.union(*(subclasses(subclass) for subclass in own))


def bind_kernels(cls: type) -> None:
    """Let the kernels in the body of a class be bound to its objects."""
    for name, value in list(vars(cls).items()):
        if getattr(value, "_is_wrapped_kernel", False) and value._is_classkernel:
            value._is_staticmethod = False  # as Taichi notes at each access
            setattr(cls, name, BoundKernel(value))
