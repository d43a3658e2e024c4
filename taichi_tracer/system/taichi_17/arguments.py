"""Fields in numpy's memory as arguments of kernels, so that no length is a part of a kernel.

While Python reads a kernel, the first ``field[i]`` of each ``memory.ArrayField`` adds an argument to the kernel: an
external array, as ``ti.types.ndarray`` has it, without a name in the source. Its index is computed from the indices and
the counts of the axes: those that the data decide are arguments, too. At each launch, the arguments are set to where
the fields are then.

``Program.create_kernel`` lets Python read a kernel. ``Program.compile_kernel`` translates it, or finds and loads what
was translated before; Taichi asks it at each launch.
"""

import ast
import functools
import math
import re
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
import taichi as ti
from taichi._lib import core
from taichi.lang import impl, matrix
from taichi.lang.ast import ast_transformer
from taichi.lang.exception import TaichiIndexError
from taichi.lang.expr import Expr, make_expr_group
from taichi.lang.struct import StructField, _IntermediateStruct

from taichi_tracer.system import compiling, memory
from taichi_tracer.system.compile_time import one_at_a_time
from taichi_tracer.system.errors import CannotCompileError, StaleSceneError
from taichi_tracer.system.stopwatch import KERNELS_MADE, KERNELS_READ, stage

FIELDS = (memory.ScalarArray, memory.MatrixArray)
AXES = 1  # of each argument: the index is computed here


@dataclass
class Argument:
    """A field as an argument of a kernel.

    Attributes:
        of: the field. number: Taichi's number of the argument. pointer: Taichi's expression of the array.
        counts: axis → Taichi's number of the argument that has its count, and the expression.
    """

    of: Any
    number: Any
    pointer: Any
    counts: dict[int, tuple[Any, Expr]] = field(default_factory=dict)

    def count(self, axis: int) -> Any:
        """How many elements there are along an axis: a constant of the code, or an argument of the kernel."""
        if self.of.constant[axis]:
            return self.of.shape[axis]
        if axis not in self.counts:
            self.counts[axis] = added_scalar(ti.i32, "count")
        return self.counts[axis][1]

    def at(self, index: Any) -> Expr:
        """The element at an index of the array."""
        runtime = impl.get_runtime()
        place = core.DebugInfo(runtime.get_current_src_info())
        builder = runtime.compiling_callable.ast_builder()
        return Expr(builder.expr_subscript(self.pointer, make_expr_group(index), place))


@dataclass
class Number:
    """A varying number as an argument of a kernel.

    Attributes:
        number: Taichi's number of the argument. value: its expression.
        owner: the object whose attribute it is. name: of the attribute. path: its indices, if that is a tuple.
    """

    number: Any
    value: Expr
    owner: Any
    name: str
    path: tuple[int, ...]


class Reading:
    """The arguments that were added to the kernel that Python reads."""

    def __init__(self) -> None:
        self.arguments: dict[int, Argument] = {}
        self.numbers: dict[tuple[int, str, tuple[int, ...]], Number] = {}

    def argument(self, of: Any) -> Argument:
        """The argument for a field; it is added to the kernel where it is asked for first."""
        if id(of) not in self.arguments:
            element = of.kind
            if of.own:
                element = core.get_type_factory_instance().get_tensor_type(list(of.own), element)
            number = impl.get_runtime().compiling_callable.insert_ndarray_param(element, AXES, "numbers", False)
            pointer = core.make_external_tensor_expr(element, AXES, number, False, 0, core.BoundaryMode.UNSAFE)
            of.numbers()
            self.arguments[id(of)] = Argument(of, number, pointer)
        return self.arguments[id(of)]

    def number(self, owner: Any, name: str, value: Any, path: tuple[int, ...] = ()) -> Any:
        """The value of an attribute with an argument for each of its varying numbers."""
        if type(value) is tuple:
            return tuple(self.number(owner, name, one, (*path, k)) for k, one in enumerate(value))
        if type(value) not in memory.VARYING:
            return value
        key = id(owner), name, path
        known = self.numbers.get(key)
        if known is None:
            kind = ti.i32 if type(value) is memory.VaryingInt else impl.get_runtime().default_fp
            known = self.numbers[key] = Number(*added_scalar(kind, name), owner, name, path)
        return known.value

    def kept(self) -> "Launch | None":
        """What a launch needs."""
        if not self.arguments and not self.numbers:
            return None
        return Launch(list(self.arguments.values()), list(self.numbers.values()))


class Launch:
    """Sets the arguments of a kernel."""

    def __init__(self, arguments: list[Argument], numbers: list[Number]) -> None:
        self.fields = [weakref.ref(one.of) for one in arguments]
        self.places = [(one.number, [(number, axis) for axis, (number, _) in one.counts.items()]) for one in arguments]
        self.numbers = [(one.number, one.name, one.path) for one in numbers]
        self.owners = [weakref.ref(one.owner) for one in numbers]

    def is_alive(self) -> bool:
        """Whether all its fields have memory."""
        found = [reference() for reference in self.fields]
        return all(field is not None and field.array is not None for field in found)

    def set(self, context: Any) -> None:
        """Set all of them in Taichi's object of a launch."""
        fields: list[Any] = [reference() for reference in self.fields]
        if any(of is None or of.array is None for of in fields):
            raise StaleSceneError("a field of this kernel was destroyed together with its owner: make a new one")
        for (number, counts), of in zip(self.places, fields, strict=True):
            array = of.array
            cells = max(1, array.size // max(1, math.prod(of.own)))
            context.set_arg_external_array_with_shape(number, array.ctypes.data, array.nbytes, (cells,), 0)
            for number_of_axis, axis in counts:
                context.set_arg_int(number_of_axis, array.shape[axis])
        for (number, name, path), reference in zip(self.numbers, self.owners, strict=True):
            value = getattr(reference(), name)
            for k in path:
                value = value[k]
            set_number = context.set_arg_float if isinstance(value, float) else context.set_arg_int
            set_number(number, value)


readings: list[Reading] = []
LAUNCHES: "weakref.WeakKeyDictionary[Any, Launch]" = weakref.WeakKeyDictionary()  # Taichi's kernel → its arguments


def argument_for(value: Any) -> Argument | None:
    """The argument for a field in numpy's memory; None for other values, and where no kernel is read."""
    of = getattr(value, "_members", [value])[0]
    return readings[-1].argument(of) if type(of) in FIELDS and readings else None


def reading(create: Callable) -> Callable:
    """``Program.create_kernel``, which notes the arguments that are added to a kernel while it is read."""

    @functools.wraps(create)
    def created(program: Any, build: Any, name: str, *words: Any) -> Any:
        def built(kernel: Any) -> None:
            build(kernel)
            if readings[-1].kept() is not None:
                kernel.finalize_params()

        readings.append(Reading())
        try:
            made = create(program, built, name, *words)
            launch = readings[-1].kept()
        finally:
            readings.pop()
        # A new kernel may have the address of a former one, and so the same number.
        LAUNCHES.pop(made, None)
        if launch is not None:
            LAUNCHES[made] = launch
        return made

    return created


def setting(make: Callable) -> Callable:
    """``Kernel.make_launch_context``, which sets the arguments that were added to the kernel."""

    @functools.wraps(make)
    def made(kernel: Any) -> Any:
        context = make(kernel)
        launch = LAUNCHES.get(kernel)
        if launch is not None:
            launch.set(context)
        return context

    return made


def added_scalar(kind: Any, name: str) -> tuple[Any, Expr]:
    """Add an argument for a number to the kernel that is read: Taichi's number of it, and its value."""
    number = impl.get_runtime().compiling_callable.insert_scalar_param(kind, name)
    return number, Expr(core.make_arg_load_expr(number, kind, False, True, 0, core.DebugInfo("")))


def subscripting(usual: Callable) -> Callable:
    """``impl.subscript``, which reads and writes elements of ``memory.ArrayField``."""

    @functools.wraps(usual)
    def subscript(builder: Any, value: Any, *indices: Any, skip_reordered: bool = False) -> Any:
        kind = type(value)
        if kind in FIELDS and readings:
            return element_of(usual, readings[-1].argument(value), indices)
        if kind is StructField and readings and type(value._members[0]) in (*FIELDS, StructField):
            members = {name: subscript(builder, one, *indices) for name, one in value._items}
            return _IntermediateStruct({**members, "__struct_methods": value.struct_methods})
        return usual(builder, value, *indices, skip_reordered=skip_reordered)

    return subscript


def element_of(usual: Callable, argument: Argument, indices: tuple[Any, ...]) -> Expr:
    """The element of a field at indices; the last axis is the one along which the memory is contiguous."""
    found, axes = flat(usual, indices, len(argument.of.constant)), len(argument.of.constant)
    if len(found) != axes:
        raise TaichiIndexError(f"Field with dim {axes} accessed with indices of dim {len(found)}")
    index: Any = 0
    for axis, one in enumerate(found):
        index = whole_number(one) if axis == 0 else index * argument.count(axis) + whole_number(one)
    if isinstance(index, Expr) and argument.of.own:
        index = index & known_range(argument)
    return argument.at(index)


def known_range(argument: Argument) -> int:
    """The largest index of a vector or of a matrix, with which all of its numbers are found by one address.

    Taichi reads their numbers one by one, at index · length + 0, 1, ... LLVM joins the reads, and computes one address
    for them, if it knows that none of these sums overflows. It does if the upper bits of the index are certainly 0.
    """
    return (1 << 30 - math.ceil(math.log2(math.prod(argument.of.own)))) - 1


def flat(usual: Callable, indices: tuple[Any, ...], count: int) -> list[Any]:
    """The indices of all axes, also if they come as one vector; none if the only one is None."""
    found: list[Any] = []
    for one in indices:
        if isinstance(one, matrix.Matrix):
            found += one.to_list()
        elif isinstance(one, (tuple, list)):
            found += one
        elif isinstance(one, Expr) and one.is_tensor():
            found += [usual(None, one, k) for k in range(one.get_shape()[0])]
        elif one is not None:
            found.append(one)
    return found


def whole_number(index: Any) -> Any:
    """An index as i32."""
    if not isinstance(index, Expr):
        if not isinstance(index, (int, np.integer)):
            raise ti.TaichiTypeError(f"indices must be integers, however '{index}' is used as index")
        return int(index)
    kind = index.ptr.get_rvalue_type()
    if kind == ti.i32:
        return index
    if not core.is_integral(kind):
        raise ti.TaichiTypeError(f"indices must be integers, however a value of type {kind.to_string()} is used")
    return ti.cast(index, ti.i32)


def loading(usual: Callable) -> Callable:
    """``ASTTransformer.build_Attribute``, which makes an argument of a varying number."""

    @functools.wraps(usual)
    def build(context: Any, node: Any) -> Any:
        value = usual(context, node)
        kind = type(value)
        if (kind in memory.VARYING or (kind is tuple and holds_varying(value))) and readings:
            if not context.is_in_static_scope():
                node.ptr = value = readings[-1].number(node.value.ptr, node.attr, value)
        return value

    return build


def holds_varying(value: Any) -> bool:
    """Whether a tuple, or one in it, has a varying number."""
    return any(type(one) in memory.VARYING or (type(one) is tuple and holds_varying(one)) for one in value)


# ── loops over fields, whose lengths are arguments ──


def looping(usual: Callable) -> Callable:
    """``ASTTransformer.build_struct_for``: a loop over an ``memory.ArrayField`` is one over ``ti.ndrange(*shape)``."""

    @functools.wraps(usual)
    def build(context: Any, node: Any, is_grouped: bool) -> None:
        over = ast_transformer.build_stmt(context, node.iter) if is_grouped else node.iter.ptr
        argument = argument_for(over)
        if argument is None:
            return usual(context, node, is_grouped)
        indices = ast.Constant(ti.ndrange(*(argument.count(axis) for axis in range(len(argument.of.constant)))))
        ast.copy_location(indices, node.iter)
        if is_grouped:
            node.iter.args = [indices]
            return ast_transformer.ASTTransformer.build_grouped_ndrange_for(context, node)
        node.iter = indices
        return ast_transformer.ASTTransformer.build_ndrange_for(context, node)

    return build


# ── the reading, the translating and the launch of a kernel ──


_NUMBERS = re.compile(r"_c\d+_\d+$")  # what Taichi adds to the name of a kernel


def launching(call: Callable) -> Callable:
    """``Kernel.__call__``, one after the other; it reads a kernel again whose objects have other fields by now."""

    @one_at_a_time
    @functools.wraps(call)
    def called(self: Any, *arguments: Any, **named: Any) -> Any:
        try:
            return call(self, *arguments, **named)
        except StaleSceneError:
            launches = {key: LAUNCHES.get(kernel) for key, kernel in self.compiled_kernels.items()}
            dead = [key for key, launch in launches.items() if launch is not None and not launch.is_alive()]
            if not dead:
                raise
            for key in dead:
                del self.compiled_kernels[key]
            return call(self, *arguments, **named)

    return called


def counting_reading(create: Callable) -> Callable:
    """``Program.create_kernel``, which reports each kernel to ``compiling``."""

    @functools.wraps(create)
    def created(program: Any, build: Any, name: str, *words: Any) -> Any:
        start = perf_counter()
        with stage(KERNELS_READ):
            made = create(program, build, name, *words)
        compiling.note_reading(made, _NUMBERS.sub("", name), start, perf_counter() - start)
        return made

    return created


def counting_translating(compile_it: Callable) -> Callable:
    """``Program.compile_kernel``, which reports each kernel to ``compiling``.

    What a GPU's backend cannot compile gives a message of one line, with what works instead.
    """

    @functools.wraps(compile_it)
    def compiled(*words: Any) -> Any:
        try:
            with stage(KERNELS_MADE), compiling.translating(words[-1]):
                return compile_it(*words)
        except RuntimeError as error:
            arch = getattr(words[-3], "arch", None)  # of the configuration, behind the program
            if arch in (None, ti.x64, ti.arm64):
                raise
            lines = str(error).strip().splitlines() or [type(error).__name__]
            raise CannotCompileError(f"{arch.name} cannot compile a kernel ({lines[0]})") from error

    return compiled
