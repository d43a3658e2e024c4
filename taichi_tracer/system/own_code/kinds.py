"""What the methods of a part must return, and what a student's own method does return while a kernel is read.

``seams(eval="vec3", pdf="number")`` says it in the class that defines the methods. A kind is "number", "truth", "vec2",
"vec3", the name of a struct, or several of them with spaces between: a method then returns as many values.
"""

import weakref
from collections.abc import Callable
from typing import Any

from taichi.lang.expr import Expr
from taichi.lang.impl import get_runtime
from taichi.lang.matrix import Matrix
from taichi.lang.struct import Struct

from taichi_tracer.system.own_code.source import fault, plain, returns, tree_of

PLAIN = {
    "number": "a number",
    "truth": "True or False",
    "vec2": "a vec2",
    "vec3": "a vec3",
    "Ray": "a tt.Ray",
    "HitData": "a tt.HitData",
}
MEMBERS = {"Ray": ("origin", "direction"), "HitData": ("is_hit", "distance")}
_expected: "weakref.WeakKeyDictionary[Callable, tuple[str, str]]" = weakref.WeakKeyDictionary()


def expect(function: Callable, what: str, gives: str) -> None:
    """From now on, look at what a function returns in kernels.

    Args:
        what: its name for messages, as "MyBrdf.eval". gives: the kind.
    """
    _expected[plain(function)] = what, gives


def look(function: Callable, value: Any) -> None:
    """Raise an OwnCodeError if a function whose kind is known returns another kind."""
    what, gives = _expected.get(function, ("", ""))
    if gives:
        told = mistake(value, gives)
        if told:
            tree = tree_of(function)
            last = returns(tree)[-1] if tree is not None and returns(tree) else None
            raise fault(function, f"{what} returns {told}", last)


def mistake(value: Any, gives: str) -> str:
    """What is wrong with a value of a kernel, and what is right; "" if it is of its kind."""
    kinds = gives.split()
    if len(kinds) > 1:
        wanted = f"({', '.join(PLAIN[kind] for kind in kinds)})"
        if not isinstance(value, (tuple, list)) or len(value) != len(kinds):
            count = f"{len(value)} values" if isinstance(value, (tuple, list)) else kind_of(value)
            return f"{count}, but {len(kinds)} are needed: {wanted}"
        for k, (one, kind) in enumerate(zip(value, kinds, strict=True)):
            told = mistake(one, kind)
            if told:
                return f"as value {k + 1} of {len(kinds)} {told}"
        return ""
    return mistake_of_one(value, gives)


def mistake_of_one(value: Any, kind: str) -> str:
    """As ``mistake``, for a single value."""
    found = kind_of(value)
    if kind in MEMBERS:
        has_all = isinstance(value, Struct) and all(name in value.keys for name in MEMBERS[kind])
        return "" if has_all else f"{found}, but {PLAIN[kind]} is needed"
    if kind == "truth":
        return "" if found in (PLAIN["number"], PLAIN["truth"]) else f"{found}, but {PLAIN[kind]} is needed"
    if found != PLAIN[kind]:
        return f"{found}, but {PLAIN[kind]} is needed{cure(value, kind)}"
    if get_runtime().default_fp.to_string() == "f32" and "f64" in types_of(value):
        advice = "leave out the cast to f64, or begin with tt.init(precision='f64')"
        return f"{found} of 64 bits, but everything is computed with 32: {advice}"
    return ""


def cure(value: Any, kind: str) -> str:
    """What to write instead of a value of another kind, where that is known."""
    if kind.startswith("vec") and kind_of(value) == PLAIN["number"]:
        return f": tm.{kind}(x) has the number in each component"
    if kind.startswith("vec") and isinstance(value, (tuple, list)) and len(value) == int(kind[3:]):
        return f": write tm.{kind}({', '.join('abc'[: len(value)])})"
    if kind == "number" and kind_of(value).startswith("a vec"):
        return ": is it one component, a length or a dot product?"
    if kind == "number" and kind_of(value) == PLAIN["truth"]:
        return ": ti.select(condition, a, b) chooses one"
    return ""


def kind_of(value: Any) -> str:
    """What a value of a kernel is, in words."""
    if value is None:
        return "nothing"
    if isinstance(value, (bool, Expr)) and types_of(value) == ["u1"]:
        return PLAIN["truth"]
    if isinstance(value, (int, float)):
        return PLAIN["number"]
    if isinstance(value, (tuple, list)):
        return f"{len(value)} values"
    if isinstance(value, Struct):
        return f"a struct with the members {', '.join(value.keys)}"
    shape = shape_of(value)
    if shape is None:
        return f"a {type(value).__name__}"
    if len(shape) == 2:
        return f"a matrix of {shape[0]} × {shape[1]}"
    return f"a vec{shape[0]}" if shape else PLAIN["number"]


def shape_of(value: Any) -> tuple[int, ...] | None:
    """The shape of a vector or matrix, () of a number, None of anything else."""
    if isinstance(value, Matrix):
        return tuple(value.get_shape())
    if isinstance(value, Expr):
        return tuple(value.get_shape()) if value.is_tensor() else ()
    return None


def types_of(value: Any) -> list[str]:
    """The types of the numbers in a value, such as "f32"; numbers of Python have none, but "u1" for True and False."""
    if isinstance(value, bool):
        return ["u1"]
    if isinstance(value, Matrix):
        return [name for one in value.entries for name in types_of(one)]
    if isinstance(value, Expr):
        kind = value.ptr.get_rvalue_type()
        return [(kind.element_type() if value.is_tensor() else kind).to_string()]
    return []
