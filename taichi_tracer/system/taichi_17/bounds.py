"""Where Taichi reads an index in somebody's own function: it is kept within the field, and noted if it was beyond."""

import functools
from collections.abc import Callable
from typing import Any

import taichi as ti
from taichi._lib import core
from taichi.lang import impl, ops
from taichi.lang.expr import Expr
from taichi.lang.field import Field
from taichi.lang.struct import StructField

from taichi_tracer.system.own_code.bounds import NUMBERS, WATCH, Place
from taichi_tracer.system.own_code.faults import PLACE
from taichi_tracer.system.own_code.kinds import types_of
from taichi_tracer.system.own_code.source import fault_at, is_own_file
from taichi_tracer.system.taichi_17 import arguments, shared
from taichi_tracer.system.taichi_17.questions import Question, noting

readings: list[tuple[Any, Any]] = []  # kernels that are being read, and Taichi's keys for their objects
watched: list[set[Place]] = []  # the watched indices in each of the kernels that are being read


def preparing(create: Callable) -> Callable:
    """``Program.create_kernel``, before which the array for indices is made."""

    @functools.wraps(create)
    def created(program: Any, build: Any, *words: Any) -> Any:
        WATCH.prepare()
        watched.append(set())
        try:
            made = create(program, build, *words)
        finally:
            places = watched.pop()
        if readings and readings[-1] in WATCH.proven:
            WATCH.proven.remove(readings[-1])
        elif places and readings:
            WATCH.forget.append((readings[-1], functools.partial(shared.forget, *readings[-1], made), places))
        return made

    return created


def checking(launch: Callable) -> Callable:
    """``Kernel.launch_kernel``, after which an index that was beyond its field is told."""

    @functools.wraps(launch)
    def launched(*words: Any) -> Any:
        found = launch(*words)
        if WATCH.forget:
            WATCH.check()
        return found

    return launched


def reading(materialize: Callable) -> Callable:
    """``Kernel.materialize``, which knows the kernel and the key for which it may be read."""

    @functools.wraps(materialize)
    def known(self: Any, key: Any = None, args: Any = None, arg_features: Any = None) -> None:
        readings.append((self, key))
        try:
            materialize(self, key=key, args=args, arg_features=arg_features)
        finally:
            readings.pop()

    return known


def keeping(usual: Callable) -> Callable:
    """``impl.subscript``, which keeps the indices of somebody's own functions within the field."""

    @functools.wraps(usual)
    def subscript(builder: Any, value: Any, *indices: Any, skip_reordered: bool = False) -> Any:
        if WATCH.found is not None and isinstance(value, Field) and indices and watched and is_new():
            found = PLACE.match(impl.get_runtime().get_current_src_info())
            if found is not None and is_own_file(found[1]):
                indices = tuple(kept(usual, value, indices, (found[1], int(found[2]))))
        return usual(builder, value, *indices, skip_reordered=skip_reordered)

    return subscript


def is_new() -> bool:
    """Whether the kernel that is read has not yet run with watched indices."""
    return not readings or readings[-1] not in WATCH.proven


def kept(usual: Callable, value: Any, indices: tuple[Any, ...], at: tuple[str, int]) -> list[Any]:
    """The indices, each within its axis; as they are where that cannot be known.

    Args:
        usual: ``impl.subscript``. at: the file and the line.
    """
    member = value._members[0] if isinstance(value, StructField) else value
    argument = arguments.argument_for(member)
    if any(one is None or isinstance(one, slice) for one in indices):
        return list(indices)
    flat = arguments.flat(usual, indices, len(member.shape))
    if len(flat) != len(member.shape) or not all(map(is_whole, flat)):
        return list(indices)
    made = []
    for axis, index in enumerate(flat):
        count = arguments.added_number(argument, "count", axis) if argument is not None else member.shape[axis]
        place = Place(*at, axis, member.shape[axis])
        if isinstance(index, int) and argument is None:
            if not 0 <= index < count:
                raise fault_at(*at, f"index {index} is beyond the field, which has {count} elements")
            made.append(index)
        elif WATCH.kept.has(place) or (number := WATCH.number_of(place)) is None:
            made.append(index)
        else:
            watched[-1].add(place)
            made.append(within(index, count, number))
    return made


def is_whole(index: Any) -> bool:
    """Whether an index is a whole number; Taichi refuses others."""
    return isinstance(index, int) or (isinstance(index, Expr) and types_of(index)[0][0] in "iu")


def within(index: Any, count: Any, number: int) -> Any:
    """An index within [0, count); one that was not is noted under the number of its place."""
    index = impl.expr_init(ops.cast(index, ti.i32))
    note(index, count, NUMBERS * number)
    return ops.max(0, ops.min(index, count - 1))


def note(index: Any, count: Any, first: int) -> None:
    """Write into the array that an index is beyond, which index, and how many elements there are."""
    builder = impl.get_runtime().compiling_callable.ast_builder()
    if noting:
        noting[-1].note_outside(Question("attribute", WATCH, "found"), WATCH.found)
    found = arguments.argument_for(WATCH.found)
    assert found is not None, "where it is noted, fields are arguments"
    is_beyond = ops.logical_or(index < 0, index >= count)
    impl.begin_frontend_if(builder, is_beyond, core.DebugInfo(impl.get_runtime().get_current_src_info()))
    builder.begin_frontend_if_true()
    for k, number in enumerate((1, index, count)):
        arguments.element_of(impl.subscript, found, (first + k,))._assign(number)
    builder.pop_scope()
    builder.begin_frontend_if_false()
    builder.pop_scope()
