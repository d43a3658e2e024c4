"""Numbers of the data, which are no part of a kernel: another value of them compiles nothing.

A number in an attribute, such as ``self.max_bounces``, becomes a constant of every kernel that reads it, and another
number another kernel. Of a ``varying`` number, the kernel gets the value at each launch: ``self.width`` is then an
argument, without a word in the kernel. In Python and in ``ti.static`` it is the usual number. ``taichi_17.arguments``
makes the arguments; without it, the number is a constant as before.
"""

from typing import Any


class VaryingInt(int):
    """A whole number that kernels get as an argument."""


class VaryingFloat(float):
    """A real number that kernels get as an argument."""


KINDS = (VaryingInt, VaryingFloat)


def varying(value: Any) -> Any:
    """A number, or a tuple of such, in the form that kernels get as an argument.

    Assign it to an attribute of an object that kernels read. The kernels see what the attribute is when they start.
    """
    if isinstance(value, tuple):
        return tuple(varying(one) for one in value)
    return VaryingFloat(value) if isinstance(value, float) else VaryingInt(value)
