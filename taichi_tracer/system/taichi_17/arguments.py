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
from taichi_tracer.system.own_code import faults
from taichi_tracer.system.stopwatch import KERNELS_MADE, KERNELS_READ, stage
from taichi_tracer.system.taichi_17 import sources

FIELDS = (memory.ScalarArray, memory.MatrixArray)
AXES = 1  # of each argument: the index is computed here


class Argument:
    """A field as an argument of a kernel.

    Attributes:
        of: the field, if somebody has it. shape, constant, own: as of the field.
        number: Taichi's number of the argument. pointer: Taichi's expression of the array.
    """

    def __init__(self, of: Any) -> None:
        self.of, self.shape, self.constant, self.own = weakref.ref(of), of.shape, of.constant, of.own
        element = of.kind
        if of.own:
            element = core.get_type_factory_instance().get_tensor_type(list(of.own), element)
        self.number = impl.get_runtime().compiling_callable.insert_ndarray_param(element, AXES, "numbers", False)
        self.pointer = core.make_external_tensor_expr(element, AXES, self.number, False, 0, core.BoundaryMode.UNSAFE)

    def count(self, axis: int) -> Any:
        """How many elements there are along an axis: a constant of the code, or an argument of the kernel."""
        return self.shape[axis] if self.constant[axis] else readings[-1].number(self.of(), "shape", ti.i32, (axis,))

    def at(self, index: Any) -> Expr:
        """The element at an index of the array."""
        runtime = impl.get_runtime()
        place = core.DebugInfo(runtime.get_current_src_info())
        builder = runtime.compiling_callable.ast_builder()
        return Expr(builder.expr_subscript(self.pointer, make_expr_group(index), place))

    def set(self, context: Any) -> None:
        """Set it in Taichi's object of a launch."""
        array: Any = getattr(self.of(), "array", None)
        if array is None:
            raise StaleSceneError("a field of this kernel was destroyed together with its owner: make a new one")
        cells = max(1, array.size // max(1, math.prod(self.own)))
        context.set_arg_external_array_with_shape(self.number, array.ctypes.data, array.nbytes, (cells,), 0)


class Number:
    """A varying number as an argument of a kernel, or the length of an axis of a field.

    Attributes:
        number: Taichi's number of the argument. value: its expression.
        owner: the object whose attribute it is. name: of the attribute. path: its indices, if that is a tuple.
    """

    def __init__(self, owner: Any, name: str, kind: Any, path: tuple[int, ...]) -> None:
        self.number = impl.get_runtime().compiling_callable.insert_scalar_param(kind, name)
        self.value = Expr(core.make_arg_load_expr(self.number, kind, False, True, 0, core.DebugInfo("")))
        self.owner, self.name, self.path = weakref.ref(owner), name, path

    def set(self, context: Any) -> None:
        """Set it in Taichi's object of a launch."""
        value = getattr(self.owner(), self.name)
        for k in self.path:
            value = value[k]
        set_number = context.set_arg_float if isinstance(value, float) else context.set_arg_int
        set_number(self.number, value)


class Reading:
    """The arguments that were added to a kernel when Python read it.

    Attributes:
        known: what stays in memory while the kernel is read, because its ``id`` is a key.
    """

    def __init__(self) -> None:
        self.arguments: dict[Any, Any] = {}
        self.known: list[Any] = []

    def added(self, key: Any, kind: Callable, owner: Any, *of: Any) -> Any:
        """The argument for a field or a number of an owner; it is added to the kernel where it is asked for first."""
        if key not in self.arguments:
            self.arguments[key] = kind(owner, *of)
            self.known.append(owner)
        return self.arguments[key]

    def argument(self, of: Any) -> Argument:
        """The argument for a field."""
        return self.added(id(of), Argument, of)

    def number(self, owner: Any, name: str, kind: Any, path: tuple[int, ...]) -> Expr:
        """The argument for a number of an object, see ``Number``."""
        return self.added((id(owner), name, path), Number, owner, name, kind, path).value

    def attribute(self, owner: Any, name: str, value: Any, path: tuple[int, ...] = ()) -> Any:
        """The value of an attribute with an argument for each of its varying numbers."""
        if type(value) is tuple:
            return tuple(self.attribute(owner, name, one, (*path, k)) for k, one in enumerate(value))
        if type(value) not in memory.VARYING:
            return value
        kind = ti.i32 if type(value) is memory.VaryingInt else impl.get_runtime().default_fp
        return self.number(owner, name, kind, path)

    def set(self, context: Any) -> None:
        """Set all of them in Taichi's object of a launch."""
        for argument in self.arguments.values():
            argument.set(context)


readings: list[Reading] = []
LAUNCHES: "weakref.WeakKeyDictionary[Any, Reading]" = weakref.WeakKeyDictionary()  # Taichi's kernel → its arguments


def reading(create: Callable) -> Callable:
    """``Program.create_kernel``, which notes the arguments that are added to a kernel while it is read.

    It reports each kernel to ``compiling``, and errors of a student's own code become one line.
    """

    @functools.wraps(create)
    def created(program: Any, build: Any, name: str, *words: Any) -> Any:
        def built(kernel: Any) -> None:
            build(kernel)
            if readings[-1].known:
                kernel.finalize_params()

        start = perf_counter()
        readings.append(Reading())
        try:
            with stage(KERNELS_READ):
                made = create(program, built, name, *words)
        except Exception as error:
            fault = faults.fault_of(error)
            if fault is None:
                raise
            raise fault from None  # whose context has what Taichi says
        finally:
            found = readings.pop()
            while sources.contexts:
                sources.contexts.pop().argument_data = ()
        # A new kernel may have the address of a former one, and so the same number.
        LAUNCHES.pop(made, None)
        if found.known:
            LAUNCHES[made] = found
        found.known = []
        compiling.note_reading(made, _NUMBERS.sub("", name), start, perf_counter() - start)
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
    found, axes = flat(usual, indices), len(argument.constant)
    if len(found) != axes:
        raise TaichiIndexError(f"Field with dim {axes} accessed with indices of dim {len(found)}")
    index: Any = 0
    for axis, one in enumerate(found):
        index = whole_number(one) if axis == 0 else index * argument.count(axis) + whole_number(one)
    if isinstance(index, Expr) and argument.own:
        # Taichi reads the numbers of a vector or of a matrix one by one, at index · length + 0, 1, ... LLVM joins the
        # reads, and computes one address for them, if it knows that none of these sums overflows. It does if the upper
        # bits of the index are certainly 0.
        index = index & (1 << 30 - math.ceil(math.log2(math.prod(argument.own)))) - 1
    return argument.at(index)


def flat(usual: Callable, indices: tuple[Any, ...]) -> list[Any]:
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
    kind = index.ptr.get_rvalue_type() if isinstance(index, Expr) else None
    if not (isinstance(index, (int, np.integer)) if kind is None else core.is_integral(kind)):
        raise ti.TaichiTypeError(f"indices must be integers, however {kind or index} is used as index")
    return int(index) if kind is None else index if kind == ti.i32 else ti.cast(index, ti.i32)


def loading(usual: Callable) -> Callable:
    """``ASTTransformer.build_Attribute``, which makes an argument of a varying number."""

    @functools.wraps(usual)
    def build(context: Any, node: Any) -> Any:
        value = usual(context, node)
        if type(value) in (tuple, *memory.VARYING) and readings and not context.is_in_static_scope():
            node.ptr = value = readings[-1].attribute(node.value.ptr, node.attr, value)
        return value

    return build


# ── loops over fields, whose lengths are arguments ──


def looping(usual: Callable) -> Callable:
    """``ASTTransformer.build_struct_for``: a loop over an ``memory.ArrayField`` is one over ``ti.ndrange(*shape)``."""

    @functools.wraps(usual)
    def build(context: Any, node: Any, is_grouped: bool) -> None:
        over = ast_transformer.build_stmt(context, node.iter) if is_grouped else node.iter.ptr
        of = getattr(over, "_members", [over])[0]
        if type(of) not in FIELDS or not readings:
            return usual(context, node, is_grouped)
        argument = readings[-1].argument(of)
        indices = ast.Constant(ti.ndrange(*(argument.count(axis) for axis in range(len(argument.constant)))))
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
    """``Kernel.__call__``, one after the other; it reads a kernel again whose objects have other fields by now.

    What a GPU's backend cannot compile or run gives a message of one line, with what works instead.
    """

    @one_at_a_time
    @functools.wraps(call)
    def called(self: Any, *arguments: Any, **named: Any) -> Any:
        try:
            return call(self, *arguments, **named)
        except StaleSceneError:
            fields_of = {
                key: [one.of() for one in LAUNCHES.get(made, Reading()).arguments.values() if isinstance(one, Argument)]
                for key, made in self.compiled_kernels.items()
            }
            dead = [k for k, fields in fields_of.items() if any(getattr(of, "array", None) is None for of in fields)]
            if not dead:
                raise
            for key in dead:
                del self.compiled_kernels[key]
            return call(self, *arguments, **named)
        except RuntimeError as error:
            arch = impl.current_cfg().arch
            if type(error) is not RuntimeError or arch in (ti.x64, ti.arm64):
                raise
            lines = str(error).strip().splitlines() or [type(error).__name__]
            raise CannotCompileError(f"{arch.name} cannot run a kernel of this scene ({lines[0]})") from error

    return called


def counting_translating(compile_it: Callable) -> Callable:
    """``Program.compile_kernel``, which reports each kernel to ``compiling``."""

    @functools.wraps(compile_it)
    def compiled(*words: Any) -> Any:
        with stage(KERNELS_MADE), compiling.translating(words[-1]):
            return compile_it(*words)

    return compiled
