"""Kernels that are read once for all objects of the same kind: a second scene, or another renderer, reads nothing.

Taichi lets Python read a kernel for each object that it is called with. Here, all that the reading asks of its objects
is noted: each attribute, and what was found there. If the kernel is called with other objects, they are asked the same
questions. If all answers are the same, the kernel that was made is used, with the arrays and the varying numbers of the
new objects as its arguments: see ``arguments``.
"""

import enum
import functools
import types
import weakref
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from taichi._lib import core
from taichi.lang.expr import Expr
from taichi.lang.field import Field, ScalarField
from taichi.lang.matrix import Matrix, MatrixField
from taichi.lang.struct import Struct, StructField, StructType

from taichi_tracer.system import arrays
from taichi_tracer.system.varying import KINDS

MOST = 8  # kernels that are remembered for each function
FOREVER = (
    *(type, types.FunctionType, types.BuiltinFunctionType, types.ModuleType, enum.Enum, np.dtype),
    *(core.DataType, functools.partial, types.WrapperDescriptorType, types.MethodWrapperType, types.GenericAlias),
)  # what is the same if it is the same object
NUMBERS = (int, float, complex, str, bytes, bool, type(None), np.generic)  # what is the same if it is equal
CONTAINERS = (list, tuple, dict, set, frozenset)  # their elements cannot be watched
PLACED = (ScalarField, MatrixField)
ASIDE = (Expr, Struct, core.Expr)  # values in the kernel, which depend on the questions before


class OtherError(Exception):
    """An object gives another answer than the one for which the kernel was read."""


class Notes:
    """The questions that the reading of a kernel asked, and the answers.

    Args:
        arguments: what the kernel was called with. Objects have numbers, in the order in which they were met.
    """

    def __init__(self, arguments: tuple[Any, ...]) -> None:
        self.objects: list[Any] = []
        self.numbers: dict[int, int] = {}
        self.asked: dict[tuple[int, str], Any] = {}
        self.written: set[tuple[int, str]] = set()
        self.is_complete = True
        self._watched: dict[type, tuple[Any, Any]] = {}
        self._is_busy = False
        self.first = tuple(self.described(one) for one in arguments)

    def described(self, value: Any) -> Any:
        """What another value must be to stand for this one: compared by ``same``."""
        kind = type(value)
        if kind in KINDS:
            return kind
        if isinstance(value, NUMBERS):
            return kind, value
        if isinstance(value, FOREVER):
            return One(value)
        if isinstance(value, Field) and not isinstance(value, (arrays.ArrayField, StructField)):
            return One(value.vars[0])  # several may stand for the same memory
        if isinstance(value, (tuple, list)):
            return kind, [self.described(one) for one in value]
        if kind is dict:
            return kind, [(self.described(key), self.described(one)) for key, one in value.items()]
        if isinstance(value, types.MethodType):
            return types.MethodType, One(value.__func__), self.described(value.__self__)
        if isinstance(value, ASIDE) or (isinstance(value, Matrix) and not is_constant(value)):
            return None
        if isinstance(value, Matrix):
            return kind, value.to_list()
        if isinstance(value, StructType):
            return kind, self.described(value.members), self.described(value.methods)
        if isinstance(value, (set, frozenset)) and all(isinstance(one, NUMBERS) for one in value):
            return kind, kind(value)
        if isinstance(value, SimpleNamespace):
            return kind, self.described(vars(value))
        if isinstance(value, StructField):
            return kind, [self.described(one) for one in value._members]
        is_array = isinstance(value, arrays.ArrayField)
        if not self._watch(kind):
            return One(value)
        number = self.numbers.get(id(value))
        if number is None:
            number = self.numbers[id(value)] = len(self.objects)
            self.objects.append(value)
        return Met(number, kind, layout(value) if is_array else None)

    def note(self, of: Any, name: str, value: Any) -> None:
        """Somebody has asked an object for an attribute, and got a value."""
        number = self.numbers.get(id(of))
        is_known = (number, name) in self.asked or (number, name) in self.written
        if number is None or self._is_busy or is_known or name in ("__dict__", "__class__"):
            return
        if isinstance(of, arrays.ArrayField) and name != "shape":  # the rest is ``layout``, or comes at each launch
            return
        self._is_busy = True
        try:
            wanted = self.described(value)
            if not is_aside(wanted):  # otherwise a property has made it, from attributes that were noted before
                self.asked[number, name] = wanted
        finally:
            self._is_busy = False

    def _watch(self, kind: type) -> bool:
        """Note from now on what is asked of objects of a class. False if that is not possible."""
        if kind in self._watched:
            return True
        if kind.__module__.startswith(("taichi.", "numpy")) or issubclass(kind, CONTAINERS):
            return False
        former = vars(kind).get("__getattribute__"), vars(kind).get("__setattr__")
        ask, assign = kind.__getattribute__, kind.__setattr__

        def asked(of: Any, name: str) -> Any:
            try:
                value = ask(of, name)
            except AttributeError:
                self.note(of, name, Missing)
                raise
            self.note(of, name, value)
            return value

        def assigned(of: Any, name: str, value: Any) -> None:
            number = self.numbers.get(id(of))
            if number is not None:
                self.written.add((number, name))
            assign(of, name, value)

        try:
            kind.__getattribute__, kind.__setattr__ = asked, assigned  # type: ignore[method-assign]
        except TypeError:  # a class of Python itself
            return False
        self._watched[kind] = former
        return True

    def end(self) -> None:
        """Leave all classes as they were."""
        for kind, former in self._watched.items():
            for name, own in zip(("__getattribute__", "__setattr__"), former, strict=True):
                if own is None:
                    delattr(kind, name)
                else:
                    setattr(kind, name, own)
        self._watched.clear()

    def forget_objects(self) -> None:
        """Keep only the questions."""
        self.objects.clear()
        self.numbers.clear()

    def objects_of(self, arguments: tuple[Any, ...]) -> list[Any] | None:
        """The objects that other arguments lead to, by the same questions; None if an answer is another one."""
        found: dict[int, Any] = {}
        try:
            for value, wanted in zip(arguments, self.first, strict=True):
                compare(value, wanted, found)
            for (number, name), wanted in self.asked.items():
                compare(getattr(found[number], name, Missing), wanted, found)
        except OtherError:
            return None
        return [found[number] for number in range(len(found))]


class Missing:
    """What stands for an attribute that an object does not have."""


class One:
    """Wants the same object."""

    def __init__(self, value: Any) -> None:
        self.value: Callable[[], Any]
        try:
            self.value = weakref.ref(value)
        except TypeError:
            self.value = lambda: value

    def is_it(self, value: Any) -> bool:
        """Whether this is the object, or a field with the same memory."""
        return self.value() is (value.vars[0] if isinstance(value, PLACED) else value)


class Met:
    """Wants an object of a class, which is always the same one.

    Args:
        number: of the object. kind: its class. layout: see ``layout``.
    """

    def __init__(self, number: int, kind: type, layout: Any = None) -> None:
        self.number, self.kind, self.layout = number, kind, layout


def compare(value: Any, wanted: Any, found: dict[int, Any]) -> None:
    """Raise an OtherError unless a value is what is wanted.

    Args:
        found: the objects that were met, by their numbers; new ones are added.
    """
    if wanted is None:
        return
    kind = type(value)
    if isinstance(wanted, One):
        if not wanted.is_it(value):
            raise OtherError
    elif isinstance(wanted, Met):
        known = found.setdefault(wanted.number, value)
        if known is not value or kind is not wanted.kind:
            raise OtherError
        if wanted.layout is not None and layout(value) != wanted.layout:
            raise OtherError
    elif isinstance(wanted, type):
        if kind is not wanted:
            raise OtherError
    elif kind is not wanted[0]:
        raise OtherError
    elif kind is types.MethodType:
        compare(value.__func__, wanted[1], found)
        compare(value.__self__, wanted[2], found)
    elif kind is SimpleNamespace:
        compare(vars(value), wanted[1], found)
    elif kind is StructType:
        compare(value.members, wanted[1], found)
        compare(value.methods, wanted[2], found)
    elif isinstance(value, Matrix):
        if value.to_list() != wanted[1]:
            raise OtherError
    elif isinstance(value, (tuple, list, StructField)):
        value = value._members if isinstance(value, StructField) else value
        if len(value) != len(wanted[1]):
            raise OtherError
        for one, other in zip(value, wanted[1], strict=True):
            compare(one, other, found)
    elif kind is dict:
        if len(value) != len(wanted[1]):
            raise OtherError
        for (key, one), (other_key, other) in zip(value.items(), wanted[1], strict=True):
            compare(key, other_key, found)
            compare(one, other, found)
    elif value != wanted[1] and value == value:  # NaN is the same as NaN
        raise OtherError


def is_constant(matrix: Matrix) -> bool:
    """Whether Python knows the numbers of a vector or of a matrix."""
    return all(isinstance(one, NUMBERS) for one in matrix.entries)


def is_aside(wanted: Any) -> bool:
    """Whether a description contains a value in the kernel."""
    has_elements = isinstance(wanted, tuple) and len(wanted) > 1 and isinstance(wanted[1], list)
    return wanted is None or (has_elements and any(map(is_aside, wanted[1])))


def layout(field: Any) -> Any:
    """What a kernel has of an ``arrays.ArrayField`` besides its arguments."""
    array = field.numbers()
    strides = [None if axis in field.variable_axes else array.strides[k] for k, axis in enumerate(field.axes)]
    whole = array.itemsize * int(np.prod(field.own))
    fits = all(stride % whole == 0 for stride in array.strides[: len(field.axes)])
    return field.kind.to_string(), field.own, tuple(field.axes), strides, fits, field.offset


class Known:
    """A kernel that was read, and for which objects.

    Attributes:
        notes: what the reading asked. kernel: Taichi's object of the kernel. launch: sets its arguments.
        features: what Taichi notes of arguments that are no objects.
    """

    def __init__(self, notes: Notes, kernel: Any, launch: Any, features: Any) -> None:
        self.notes, self.kernel, self.launch, self.features = notes, kernel, launch, features


def objects_in(kernel: Any, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """The template arguments of a call."""
    return tuple(arguments[k] for k in kernel.template_slot_locations)


def features_in(kernel: Any, features: Any) -> Any:
    """What Taichi notes of the other arguments of a call."""
    return tuple(one for k, one in enumerate(features) if k not in kernel.template_slot_locations)


def sharing(usual: Callable) -> Callable:
    """``Kernel.materialize``, which reads a kernel only if it was not read for objects that are alike."""

    @functools.wraps(usual)
    def materialize(self: Any, key: Any = None, args: Any = None, arg_features: Any = None) -> None:
        if key is None or key in self.compiled_kernels or not self.template_slot_locations or not arrays.are_possible():
            usual(self, key=key, args=args, arg_features=arg_features)
            return
        self.runtime.materialize()  # it may forget all kernels
        known = self.__dict__.setdefault("known", [])
        if not self.compiled_kernels:
            known.clear()
        objects, features = objects_in(self, args), features_in(self, arg_features)
        for one in known:
            if one.features == features and one.kernel in self.compiled_kernels.values():
                found = one.notes.objects_of(objects)
                launch = one.launch if found is None or one.launch is None else one.launch.of(found)
                if found is not None and (launch is None) == (one.launch is None):
                    self.compiled_kernels[key] = one.kernel
                    launches(self)[key] = launch
                    return
        notes = Notes(objects)
        _noting.append(notes)
        try:
            usual(self, key=key, args=args, arg_features=arg_features)
        finally:
            _noting.pop()
            notes.end()
        kernel = self.compiled_kernels[key]
        launch = arguments_of(kernel)
        is_shared = launch is None or launch.know(notes.numbers)
        notes.forget_objects()
        if is_shared:
            known.insert(0, Known(notes, kernel, launch, features))
            del known[MOST:]

    return materialize


def choosing(usual: Callable) -> Callable:
    """``Kernel.ensure_compiled``, which Taichi calls before a launch: it chooses the arguments of the objects."""

    @functools.wraps(usual)
    def ensure_compiled(self: Any, *args: Any) -> Any:
        global _chosen
        key = usual(self, *args)
        _chosen = launches(self).get(key) or arguments_of(self.compiled_kernels[key])
        if _chosen is not None and not _chosen.is_alive():  # an object of the kernel has other arrays by now
            del self.compiled_kernels[key]
            launches(self).pop(key, None)
            key = usual(self, *args)
            _chosen = launches(self).get(key) or arguments_of(self.compiled_kernels[key])
        return key

    return ensure_compiled


def launches(kernel: Any) -> dict[Any, Any]:
    """key → what sets the arguments, for the calls of a kernel that was read for other objects."""
    return kernel.__dict__.setdefault("launches", {})


def arguments_of(kernel: Any) -> Any:
    """What sets the arguments of a kernel for the objects for which it was read; None if it has none."""
    return LAUNCHES.get(kernel)


def chosen() -> Any:
    """What sets the arguments of the launch that comes next."""
    global _chosen
    now, _chosen = _chosen, None
    return now


LAUNCHES: "weakref.WeakKeyDictionary[Any, Any]" = (
    weakref.WeakKeyDictionary()
)  # Taichi's object of a kernel → ``Launch``
_noting: list[Notes] = []
_chosen: Any = None
