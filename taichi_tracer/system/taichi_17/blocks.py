"""Blocks of their own around long calculations, so that a kernel compiles in less time.

Taichi 1.7 lowers a kernel one assignment after the other. After each, it looks for uses of what it has replaced: in the
whole block of the assignment, and in the blocks around it. Therefore the time is the product of the number of all
statements and of the number of those that stand in the blocks around them, and a long calculation is expensive where
much else follows in the same block, or in blocks within it. In a block of its own, it concerns nobody else.

Here, a call of one of ``LONG`` is the block of an ``if`` whose condition is always true, which the compiler leaves out.
The numbers of its result are copied into variables that stand before the block, and take their types from the copies.
So the block changes no number, and no type either.
"""

import functools
from collections.abc import Callable
from typing import Any

from taichi._lib import core
from taichi.lang import impl
from taichi.lang.expr import Expr
from taichi.lang.struct import Struct

PACKAGE = "taichi_tracer."
# Functions in files that students read, which are long and are called where much else follows → how many numbers and
# vectors a result has at most. With each of them, the kernel of some picture compiles in less time.
LONG = {
    "PointSampler.get_2d": 1,
    "FarLights.sample": 4,
    "EyeRays.hit_of": 12,
    "Paths.light_sample": 1,
    "WideBVH.met_children": 2,
}


def in_blocks(call: Callable) -> Callable:
    """``Func.__call__``, which puts long functions into a kernel; each has a block of its own there."""

    @functools.wraps(call)
    def called(self: Any, *arguments: Any, **options: Any) -> Any:
        most = LONG.get(self.func.__qualname__)
        if most is None or not self.func.__module__.startswith(PACKAGE) or not impl.inside_kernel():
            return call(self, *arguments, **options)
        builder = impl.get_runtime().compiling_callable.ast_builder()
        places = [impl.expr_init(None) for _ in range(most)]
        place = core.DebugInfo(impl.get_runtime().get_current_src_info())
        impl.begin_frontend_if(builder, True, place)
        builder.begin_frontend_if_true()
        free = iter(places)
        result = copied(call(self, *arguments, **options), free)
        for unused in free:
            unused._assign(0)
        builder.pop_scope()
        builder.begin_frontend_if_false()
        builder.pop_scope()
        return result

    return called


def copied(result: Any, free: Any) -> Any:
    """What a function returns, with every number of the kernel copied into the next free variable."""
    if isinstance(result, Expr):
        variable = next(free)
        variable._assign(result)
        return variable
    if isinstance(result, (tuple, list)):
        return type(result)(copied(one, free) for one in result)
    if isinstance(result, Struct):
        made = Struct({"__struct_methods": result.methods})
        made.entries.update({name: copied(one, free) for name, one in result.entries.items()})
        made._register_members()
        return made
    return result  # what Python knows while the kernel is read
