"""What the methods of a part must return, and what a student's own method does return while a kernel is read.

``overridable(eval="vec3", pdf="number")`` says it in the class that defines the methods. A kind is "number", "truth",
"vec2", "vec3", the name of a struct, or several of them with spaces between: a method then returns as many values.
"""

import weakref
from collections.abc import Callable
from typing import Any

from taichi.lang.expr import Expr
from taichi.lang.matrix import Matrix
from taichi.lang.struct import Struct

from taichi_tracer.system.own_code.source import fault, returns, tree_of, unwrap

PLAIN = {
    "number": "a number",
    "truth": "True or False",
    "vec2": "a vec2",
    "vec3": "a vec3",
    "Ray": "a tt.Ray",
    "HitData": "a tt.HitData",
}
MEMBERS = {"Ray": ("origin", "direction"), "HitData": ("is_hit", "distance")}
ONE_NUMBER = ": is it one component, a length or a dot product?"
CURES = {  # (what is returned, the kind that is needed) → what to write
    ("a number", "vec2"): ": tm.vec2(x) has the number in each component",
    ("a number", "vec3"): ": tm.vec3(x) has the number in each component",
    ("2 values", "vec2"): ": write tm.vec2(a, b)",
    ("3 values", "vec3"): ": write tm.vec3(a, b, c)",
    ("a vec2", "number"): ONE_NUMBER,
    ("a vec3", "number"): ONE_NUMBER,
    ("True or False", "number"): ": ti.select(condition, a, b) chooses one",
}
# Function → (its name for messages, as "MyBrdf.eval", and the kind of what it must return).
expected: "weakref.WeakKeyDictionary[Callable, tuple[str, str]]" = weakref.WeakKeyDictionary()


def look(function: Callable, value: Any) -> None:
    """Raise an OwnCodeError if a function whose kind is known returns another kind."""
    what, gives = expected.get(function, ("", ""))
    wrong = mistake(value, gives) if gives else ""
    if wrong:
        tree = tree_of(unwrap(function))
        raise fault(function, f"{what} returns {wrong}", (returns(tree) if tree is not None else [None])[-1])


def mistake(value: Any, gives: str) -> str:
    """What is wrong with a value of a kernel, and what is right; "" if it is of its kind."""
    kinds, found = gives.split(), kind_of(value)
    if len(kinds) > 1:
        if found != f"{len(kinds)} values":
            return f"{found}, but {len(kinds)} are needed: ({', '.join(PLAIN[kind] for kind in kinds)})"
        wrong = [(k, mistake(*one)) for k, one in enumerate(zip(value, kinds, strict=True), 1)]
        return next((f"as value {k} of {len(kinds)} {text}" for k, text in wrong if text), "")
    if gives in MEMBERS:
        is_right = isinstance(value, Struct) and all(name in value.keys for name in MEMBERS[gives])
    else:
        is_right = found == PLAIN[gives] or (found, gives) == (PLAIN["number"], "truth")
    return "" if is_right else f"{found}, but {PLAIN[gives]} is needed{CURES.get((found, gives), '')}"


def kind_of(value: Any) -> str:
    """What a value of a kernel is, in words."""
    if value is None:
        return "nothing"
    if isinstance(value, (bool, Expr)) and types_of(value) == ["u1"]:
        return PLAIN["truth"]
    if isinstance(value, (tuple, list)):
        return f"{len(value)} values"
    if isinstance(value, Struct):
        return f"a struct with the members {', '.join(value.keys)}"
    shape = () if isinstance(value, (int, float)) else shape_of(value)
    if shape is None:
        return f"a {type(value).__name__}"
    if len(shape) == 2:
        return f"a matrix of {shape[0]} × {shape[1]}"
    return f"a vec{shape[0]}" if shape else PLAIN["number"]


def shape_of(value: Any) -> tuple[int, ...] | None:
    """The shape of a vector or matrix, () of a number, None of anything else."""
    is_vector = isinstance(value, Matrix) or (isinstance(value, Expr) and value.is_tensor())
    return tuple(value.get_shape()) if is_vector else () if isinstance(value, Expr) else None


def types_of(value: Any) -> list[str]:
    """The types of the numbers in a value, such as "f32"; numbers of Python have none, but "u1" for True and False."""
    if isinstance(value, Matrix):
        return [name for one in value.entries for name in types_of(one)]
    if isinstance(value, Expr):
        kind = value.ptr.get_rvalue_type()
        return [(kind.element_type() if value.is_tensor() else kind).to_string()]
    return ["u1"] if isinstance(value, bool) else []
