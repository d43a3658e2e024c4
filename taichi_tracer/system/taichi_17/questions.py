"""What the reading of a kernel asks of its objects, of names, classes and modules; and whether others answer alike.

See ``shared``: a kernel that was read is used for other objects if all answers are the same.
"""

import enum
import functools
import types
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from taichi._lib import core
from taichi.lang.expr import Expr
from taichi.lang.field import Field, ScalarField
from taichi.lang.matrix import Matrix, MatrixField
from taichi.lang.struct import Struct, StructField, StructType

from taichi_tracer.system import arrays
from taichi_tracer.system.seams import LISTENERS, replaced
from taichi_tracer.system.varying import KINDS

MOST_NUMBERS = 4096  # of an array that may be a constant of a kernel; larger ones are the same if they are one object
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
        self.outside: dict[Any, tuple[Question, Any]] = {}  # of names and classes: the question, the answer
        self.replaced: dict[int, tuple[str, ...]] = {}  # number of an object → what ``seams.replaced`` said of it
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
        if kind is np.ndarray and value.size <= MOST_NUMBERS:
            return kind, numbers_of(value)
        if isinstance(value, Field) and not isinstance(value, (arrays.ArrayField, StructField)):
            return Place(value)
        if isinstance(value, (tuple, list)):
            return kind, [self.described(one) for one in value]
        if kind is dict:
            return kind, [(self.described(key), self.described(one)) for key, one in value.items()]
        if isinstance(value, types.MethodType):
            return types.MethodType, One(value.__func__), self.described(value.__self__)
        if isinstance(value, ASIDE) or (isinstance(value, Matrix) and not is_constant(value)):
            return None
        if isinstance(value, Matrix):
            return kind, numbers_of(value)
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
        return Met(number, One(kind), layout(value) if is_array else None)

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

    def note_outside(self, question: "Question", value: Any) -> None:
        """Somebody has asked for a name or for an attribute of a class or of a module, and got a value."""
        key = id(question.of), question.name
        if not self._is_busy and key not in self.outside:
            self._is_busy = True
            try:
                self.outside[key] = question, self.described(value)
            finally:
                self._is_busy = False

    def note_replaced(self, part: Any, names: tuple[str, ...]) -> None:
        """Somebody has asked which methods of a part were replaced."""
        number = self.numbers.get(id(part))
        if number is not None:
            self.replaced[number] = names
        elif isinstance(part, type):
            self.note_outside(Question("methods", part, ""), names)

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
            for question, wanted in self.outside.values():
                compare(question.answer(), wanted, found)
            for (number, name), wanted in self.asked.items():
                compare(getattr(found[number], name, Missing), wanted, found)
            if any(replaced(found[number]) != names for number, names in self.replaced.items()):
                return None
        except OtherError:
            return None
        return [found[number] for number in range(len(found))]


class Missing:
    """What stands for an attribute that an object does not have."""


@dataclass(frozen=True)
class Question:
    """A question that is not about an object of the kernel.

    Attributes:
        kind: "name" of a module, "cell" of a function in another one, "attribute" of a class or of a module, or
            "methods" of a class that were replaced.
        of: the names, the cell, or the class or the module. name: what is asked for.
    """

    kind: str
    of: Any
    name: str

    def answer(self) -> Any:
        """What is there now."""
        if self.kind == "name":
            return self.of.get(self.name, Missing)
        if self.kind == "methods":
            return replaced(self.of)
        return self.of.cell_contents if self.kind == "cell" else getattr(self.of, self.name, Missing)


class NotedNames(dict):
    """The names that a function of a kernel can use besides its own, which are noted as they are asked for.

    Args:
        names: name → value. function: it has them from its module, and from the functions around it.
    """

    def __init__(self, names: dict[str, Any], function: Any) -> None:
        super().__init__(names)
        self.function, self.own = function, set()  # type: tuple[Any, set[str]]

    def __setitem__(self, name: str, value: Any) -> None:
        self.own.add(name)  # an argument of the kernel
        super().__setitem__(name, value)

    def __getitem__(self, name: str) -> Any:
        value = super().__getitem__(name)
        if noting and name not in self.own:
            of = self.function
            if name in of.__code__.co_freevars:
                cell = of.__closure__[of.__code__.co_freevars.index(name)]
                noting[-1].note_outside(Question("cell", cell, name), value)
            else:
                noting[-1].note_outside(Question("name", of.__globals__, name), value)
        return value


def naming(usual: Callable) -> Callable:
    """``kernel_impl._get_global_vars``, whose names are noted."""
    return functools.wraps(usual)(lambda function: NotedNames(usual(function), function))


def note_static(of: Any, name: str, value: Any) -> None:
    """Note what a kernel has found at a class or at a module, unless it is one of Taichi's or of numpy's."""
    home = of.__name__ if isinstance(of, types.ModuleType) else of.__module__
    if noting and not home.startswith(("taichi.", "numpy", "math")):
        noting[-1].note_outside(Question("attribute", of, name), value)


@LISTENERS.append
def note_replaced(part: Any, names: tuple[str, ...]) -> None:
    """Note which methods of a part were replaced, where a kernel is read."""
    if noting:
        noting[-1].note_replaced(part, names)


class One:
    """Wants the same object."""

    def __init__(self, value: Any) -> None:
        self.value: Callable[[], Any]
        try:
            self.value = weakref.ref(value)
        except TypeError:
            self.value = lambda: value

    def is_it(self, value: Any) -> bool:
        """Whether this is the object."""
        return self.value() is value


class Place(One):
    """Wants a field of Taichi's with the same memory, for which several objects may stand."""

    def __init__(self, field: Any) -> None:
        super().__init__(field.vars[0])
        self.form = form_of(field)

    def is_it(self, value: Any) -> bool:
        """Whether this is such a field."""
        return isinstance(value, PLACED) and super().is_it(value.vars[0]) and form_of(value) == self.form


class Met:
    """Wants an object of a class, which is always the same one.

    Args:
        number: of the object. kind: wants its class. layout: see ``layout``.
    """

    def __init__(self, number: int, kind: One, layout: Any = None) -> None:
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
        if known is not value or not wanted.kind.is_it(kind):
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
    elif isinstance(value, (Matrix, np.ndarray)):
        if numbers_of(value) != wanted[1]:
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


def numbers_of(value: Matrix | np.ndarray) -> Any:
    """What two vectors, matrices or arrays have in common that are equal."""
    return value.to_list() if isinstance(value, Matrix) else (value.shape, value.dtype.str, value.tobytes())


def is_constant(matrix: Matrix) -> bool:
    """Whether Python knows the numbers of a vector or of a matrix."""
    return all(isinstance(one, NUMBERS) for one in matrix.entries)


def is_aside(wanted: Any) -> bool:
    """Whether a description contains a value in the kernel."""
    has_elements = isinstance(wanted, tuple) and len(wanted) > 1 and isinstance(wanted[1], list)
    return wanted is None or (has_elements and any(map(is_aside, wanted[1])))


def form_of(field: Any) -> tuple[str, int, Any, Any]:
    """What a field of Taichi's is: of numbers, vectors or matrices, how many parts it has, and its rows and columns."""
    return type(field).__name__, len(field.vars), getattr(field, "n", None), getattr(field, "m", None)


def layout(field: Any) -> Any:
    """What a kernel has of an ``arrays.ArrayField`` besides its arguments."""
    array = field.numbers()
    strides = [None if axis in field.variable_axes else array.strides[k] for k, axis in enumerate(field.axes)]
    whole = array.itemsize * int(np.prod(field.own))
    fits = all(stride % whole == 0 for stride in array.strides[: len(field.axes)])
    return field.kind.to_string(), field.own, tuple(field.axes), strides, fits, field.offset


noting: list[Notes] = []
