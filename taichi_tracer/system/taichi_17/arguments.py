"""Fields in numpy's memory as arguments of kernels, so that no length is a part of a kernel.

While Python reads a kernel, the first ``field[i]`` of each ``arrays.ArrayField`` adds an argument to the kernel: an
external array, as ``ti.types.ndarray`` has it, without a name in the source. Its index is computed from the indices and
the strides of the field: those within a cell are constants, those that depend on a number of cells are arguments, too.
At each launch, the arguments are set to where the fields are then.
"""

import functools
import math
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import taichi as ti
from taichi._lib import core
from taichi.lang import impl, matrix
from taichi.lang.exception import TaichiIndexError
from taichi.lang.expr import Expr, make_expr_group
from taichi.lang.struct import StructField, _IntermediateStruct

from taichi_tracer.system import arrays
from taichi_tracer.system.errors import StaleSceneError
from taichi_tracer.system.taichi_17.components import LooseComponents
from taichi_tracer.system.varying import KINDS, VaryingInt

FIELDS = (arrays.ScalarArray, arrays.MatrixArray)
AXES = 1  # of each argument: the index is computed here


@dataclass
class Slot:
    """An array as an argument of a kernel: what one or more fields share that have elements in the same cells.

    Attributes:
        number: Taichi's number of the argument. pointer: Taichi's expression of the array. size: bytes of an element.
        of: the fields. is_block: whether the array begins where their cells do, and not where the only field does.
        values: "stride" or "count", and Taichi's number of an axis → the argument that has it.
    """

    number: Any
    pointer: Any
    size: int
    of: list[Any]
    is_block: bool
    values: dict[tuple[str, int], Expr] = field(default_factory=dict)


@dataclass
class Argument:
    """A field in an argument of a kernel.

    Attributes:
        of: the field. slot: the array. element: the type of what one index reads.
        strides: for each axis, in elements: a constant, or an expression. first: the index of the first element.
        numbers: numbers of arguments, and what they are: "stride" or "count" of an axis.
    """

    of: Any
    slot: Slot
    element: Any
    first: int
    strides: list[Any] = field(default_factory=list)
    numbers: list[tuple[Any, str, int]] = field(default_factory=list)

    @property
    def is_vector(self) -> bool:
        """Whether one index reads a whole vector or matrix."""
        return self.element is not self.of.kind

    def at(self, index: Any) -> Expr:
        """The element at an index of the array."""
        runtime = impl.get_runtime()
        place = core.DebugInfo(runtime.get_current_src_info())
        builder = runtime.compiling_callable.ast_builder()
        return Expr(builder.expr_subscript(self.slot.pointer, make_expr_group(index), place))


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
        self.slots: dict[Any, Slot] = {}
        self.numbers: dict[tuple[int, str, tuple[int, ...]], Number] = {}

    def argument(self, of: Any) -> Argument:
        """The argument for a field."""
        known = self.arguments.get(id(of))
        if known is None:
            known = self.arguments[id(of)] = self.added(of)
        return known

    def added(self, of: Any) -> Argument:
        """Add an argument for a field to the kernel that is read, unless one of its block can be used."""
        array, element = of.numbers(), of.kind
        size, whole = array.itemsize, array.itemsize * math.prod(of.own)
        strides = array.strides[: len(of.axes)]
        if of.own and all(stride % whole == 0 for stride in strides):
            element, size = core.get_type_factory_instance().get_tensor_type(list(of.own), element), whole
        first, rest = divmod(of.offset, size)
        key = id(of.block), of.kind.to_string(), of.own if size > array.itemsize else (), id(of) if rest else 0
        slot = self.slots.get(key)
        if slot is None:
            number = impl.get_runtime().compiling_callable.insert_ndarray_param(element, AXES, "numbers", False)
            pointer = core.make_external_tensor_expr(element, AXES, number, False, 0, core.BoundaryMode.UNSAFE)
            slot = self.slots[key] = Slot(number, pointer, size, [], not rest)
        slot.of.append(of)
        made = Argument(of, slot, element, 0 if rest else first)
        for axis, stride in enumerate(strides):
            is_variable = of.axes[axis] in of.variable_axes
            made.strides.append(added_number(made, "stride", axis) if is_variable else stride // size)
        return made

    def number(self, owner: Any, name: str, value: Any, path: tuple[int, ...] = ()) -> Any:
        """The value of an attribute with an argument for each of its varying numbers."""
        if type(value) is tuple:
            return tuple(self.number(owner, name, one, (*path, k)) for k, one in enumerate(value))
        if type(value) not in KINDS:
            return value
        key = id(owner), name, path
        known = self.numbers.get(key)
        if known is None:
            kind = ti.i32 if type(value) is VaryingInt else impl.get_runtime().default_fp
            known = self.numbers[key] = Number(*added_scalar(kind, name), owner, name, path)
        return known.value

    def kept(self) -> "Launch | None":
        """What a launch needs."""
        if not self.arguments and not self.numbers:
            return None
        return Launch(list(self.arguments.values()), list(self.slots.values()), list(self.numbers.values()))


class Launch:
    """Sets the arguments of a kernel."""

    def __init__(self, arguments: list[Argument], slots: list[Slot], numbers: list[Number]) -> None:
        places = {id(one.of): place for place, one in enumerate(arguments)}
        self.fields = [weakref.ref(one.of) for one in arguments]
        self.slots = [(one.number, one.size, one.is_block, [places[id(of)] for of in one.of]) for one in slots]
        self.counts = [
            (number, what, axis, one.slot.size, place)
            for place, one in enumerate(arguments)
            for number, what, axis in one.numbers
        ]
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
        for number, size, is_block, places in self.slots:
            of = fields[places[0]]
            cells = max(1, of.block.nbytes // size)
            address = of.address - of.offset if is_block else of.address
            context.set_arg_external_array_with_shape(number, address, cells * size, (cells,), 0)
        for number, what, axis, size, place in self.counts:
            array = fields[place].array
            context.set_arg_int(number, array.strides[axis] // size if what == "stride" else array.shape[axis])
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


def use() -> None:
    """Let the package make fields that are arguments."""
    arrays.use()


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
        # Python's object of a kernel that is gone stands for a new one at the same address, too.
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


def reading_again(usual: Callable) -> Callable:
    """``Kernel.ensure_compiled``, which reads a kernel again whose objects have other fields by now."""

    @functools.wraps(usual)
    def ensure_compiled(self: Any, *args: Any) -> Any:
        key = usual(self, *args)
        launch = LAUNCHES.get(self.compiled_kernels[key])
        if launch is not None and not launch.is_alive():
            del self.compiled_kernels[key]
            key = usual(self, *args)
        return key

    return ensure_compiled


def added_number(argument: Argument, what: str, axis: int) -> Expr:
    """Add an argument for the stride of an axis, or for its count, to the kernel that is read."""
    key = what, argument.of.axes[axis]
    if key not in argument.slot.values:
        number, argument.slot.values[key] = added_scalar(ti.i32, what)
        argument.numbers.append((number, what, axis))
    return argument.slot.values[key]


def added_scalar(kind: Any, name: str) -> tuple[Any, Expr]:
    """Add an argument for a number to the kernel that is read: Taichi's number of it, and its value."""
    number = impl.get_runtime().compiling_callable.insert_scalar_param(kind, name)
    return number, Expr(core.make_arg_load_expr(number, kind, False, True, 0, core.DebugInfo("")))


def subscripting(usual: Callable) -> Callable:
    """``impl.subscript``, which reads and writes elements of ``arrays.ArrayField``."""

    @functools.wraps(usual)
    def subscript(builder: Any, value: Any, *indices: Any, skip_reordered: bool = False) -> Any:
        kind = type(value)
        if kind in FIELDS and readings:
            return element_of(usual, readings[-1].argument(value), indices)
        if kind is StructField and readings and type(value._members[0]) in (*FIELDS, StructField):
            members = {name: subscript(builder, one, *indices) for name, one in value._items}
            return _IntermediateStruct({**members, "__struct_methods": value.struct_methods})
        if kind is LooseComponents and not any(isinstance(one, slice) for one in indices):
            return value.part(*flat(usual, indices, len(value.argument.of.own)))
        return usual(builder, value, *indices, skip_reordered=skip_reordered)

    return subscript


def element_of(usual: Callable, argument: Argument, indices: tuple[Any, ...]) -> Expr:
    """The element of a field at indices."""
    found = flat(usual, indices, len(argument.strides))
    if len(found) != len(argument.strides):
        raise TaichiIndexError(f"Field with dim {len(argument.strides)} accessed with indices of dim {len(found)}")
    index: Any = None
    for one, stride in zip(found, argument.strides, strict=True):
        term = whole_number(one)
        if not isinstance(stride, int) or stride != 1:
            term = term * stride
        index = term if index is None else index + term
    if isinstance(index, Expr) and (argument.of.own or argument.first):
        index = index & known_range(argument)
    if index is None or argument.first:
        index = argument.first if index is None else index + argument.first
    if argument.of.own and not argument.is_vector:
        return LooseComponents(argument, index)
    return argument.at(index)


def known_range(argument: Argument) -> int:
    """The largest index of a vector or of a matrix, with which all of its numbers are found by one address.

    Taichi reads their numbers one by one, at index · length + 0, 1, ... LLVM joins the reads, and computes one address
    for them, if it knows that none of these sums overflows. It does if the upper bits of the index are certainly 0.
    """
    if not argument.is_vector:
        return (1 << 30) - 1
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
        if (kind in KINDS or (kind is tuple and holds_varying(value))) and readings:
            if not context.is_in_static_scope():
                node.ptr = value = readings[-1].number(node.value.ptr, node.attr, value)
        return value

    return build


def holds_varying(value: Any) -> bool:
    """Whether a tuple, or one in it, has a varying number."""
    return any(type(one) in KINDS or (type(one) is tuple and holds_varying(one)) for one in value)
