"""A mark for long functions, whose calls get blocks of their own in kernels: see ``taichi_17.blocks``."""

from collections.abc import Callable
from typing import TypeVar

Function = TypeVar("Function", bound=Callable)


def in_own_block(values: int) -> Callable[[Function], Function]:
    """A decorator, below ``@ti.func``, of a function that is long and is called where much else follows.

    Args:
        values: how many numbers and vectors its result has at most.
    """

    def mark(function: Function) -> Function:
        vars(function)["block_values"] = values
        return function

    return mark
