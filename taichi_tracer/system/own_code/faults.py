"""Taichi's errors in somebody's own function: in one line, with its place and with what is right."""

import ast
import inspect
import linecache
import re
from typing import Any

import numpy as np
import taichi.math
from taichi.lang.exception import TaichiCompilationError
from taichi.lang.expr import Expr
from taichi.lang.field import Field
from taichi.lang.struct import Struct

from taichi_tracer.system.errors import InputError, nearest
from taichi_tracer.system.own_code.checks import PACKAGE, fault_at, is_own_file

PLACE = re.compile(r'(?:^|: ) *File "(.+)", line (\d+), in (.+?):?$', re.MULTILINE)  # as Taichi and Python write places
VALUE = "keep the value in a variable, and return it in the last line"
A_FUNCTION = "does a function return nothing?"
IN_KERNEL = "is a function of Python, and this runs in a kernel: use"
SHARED = "|".join(name for name in dir(taichi.math) if hasattr(np, name))  # functions that numpy and Taichi have
# What Taichi says, and below it the student's line → what it means; {0}, {1}, … are the groups of the pattern.
MEANINGS = {
    r"Did you mean to use `(.+?)` instead of `(.+?)`": "{1} is a function of Python: write {0}",
    r"'(?:Scalar|Matrix)(?:Array|Field)'(?s:.*)\n.*?\b(self\.\w+)\b(?![.\[(])": "write {0}[None]",
    r"\n.*\b(np\.(?:as)?array)\((self\.\w+)\).*$": f"{{0}} {IN_KERNEL} {{1}}[None]",
    rf"\n.*\b(np\.({SHARED}))\(.*$": f"{{0}} {IN_KERNEL} tm.{{1}}",
    r"\n.*\b(np\.[\w.]*?(\w+))\(.*$": f"{{0}} {IN_KERNEL} what taichi.math has, or a method such as v.norm()",
    r"calling `(\w+)`: Python cannot decide": "{0} is called in a kernel: write @ti.func above it",
    r"Return inside non-static if/for": f"a return stands in an if or in a loop: {VALUE}",
    r"Integer literal (\S+) exceeded": "the whole number {0} has more than 32 bits: write ti.u64({0}), or a float",
    r"RecursionError": "a function calls itself, which kernels cannot do: write a loop",
    r"constant scalar data type: <class 'str'>": "a text is no value of a kernel: use a number, or ti.static",
    r"constant scalar data type: <class 'NoneType'>": f"None is no value of a kernel: {A_FUNCTION}",
    r"constant scalar data type: <class '.*?(\w+)'>": "a {0} is no value of a kernel",
    r"unsupported operand type.*'NoneType'": f"None is no number: {A_FUNCTION}",
    r'Unsupported node "Lambda"': "there is no lambda in kernels: write a function with @ti.func",
    r'Unsupported node "(\w+)"': "there is no {0} in kernels",
    r"Only dict or Struct can be assigned": "the variable holds a struct, and the new value is none: use another name",
    r"cannot assign '\[Tensor \((\d+)\) .*?\]' to '\[Tensor \((\d+)\)": "a vec{0} cannot take the place of a vec{1}",
    r"cannot assign '(\S+|\[.*?\])' to '(\S+|\[.*?\])'": "a {0} cannot take the place of a {1}",
    r"IndexError: only integers": "no index of a numpy array comes from a kernel: use ti.Vector(list(a)) or ti.field",
    r"list indices must be integers": "no index of a list comes from a kernel: use ti.Vector(a), or a ti.field",
    r"Variable '(.+?)' cannot be assigned": "{0} is a value of Python: a kernel changes variables and ti.fields",
    r"Operator \"(.+?)\" in Taichi scope is not supported": "there is no `{0}` in kernels",
    r"Kernel argument \"(\w+)\" is immutable": "{0} is an argument of the kernel: give the new value another name",
    r"number of targets is not equal to value length": "one side of the assignment has more values than the other",
    r"Number of args is different from number of positions": "a format such as :.2g is not known in kernels",
    r"Too many arguments\. Expected \(\)": "a function without arguments is called with some",
    r"Too many arguments\. Expected \((\w+) : ": "a function whose first argument is {0} is called with too many",
    r"Parameter `(\w+)` missing": "a function is called without its argument {0}",
}
# A member of a struct → what it may be called instead.
ALSO = {
    "distance": "t dist depth",
    "barycentric_coords": "u v uv w bary barycentric barycentrics",
    "triangle_id": "id index triangle",
    "normal": "n",
    "is_hit": "hit valid",
    "material_id": "material mat",
    "origin": "o org",
    "direction": "d dir",
}
NODES = {"Try": "try", "With": "with", "Global": "global", "Import": "import", "ClassDef": "class", "Yield": "yield"}


def fault_of(error: BaseException) -> InputError | None:
    """The line for an error that came while a kernel of the package was read; None if it came from no own code."""
    root = root_of(error)
    places = [(file, int(line)) for file, line, _ in PLACE.findall(str(error))]
    own = [one for one in places if is_own_file(one[0])]
    if isinstance(root, InputError):
        return root
    if not own or not places[0][0].startswith(PACKAGE):
        return None
    file, line = own[-1]
    return fault_at(file, line, meaning(root, str(error), file, line))


def root_of(error: BaseException) -> BaseException:
    """The error that Taichi met: it raises another one at each level, which has the text of the former one.

    What Taichi says itself may come from an error within Taichi, which means nothing to the user.
    """
    is_of_python = "Traceback (most recent call last)" in str(error)
    found = error
    while error.__context__ is not None:
        error = error.__context__
        if is_of_python or isinstance(error, (TaichiCompilationError, InputError)):
            found = error
    return found


def meaning(root: BaseException, text: str, file: str, line: int) -> str:
    """What an error means, and what would be right.

    Args:
        text: Taichi's message. file, line: the innermost place in somebody's own code.
    """
    shown = linecache.getline(file, line).rstrip()
    if isinstance(root, AttributeError) and root.name and not isinstance(root.obj, Field):
        return lacking(root.obj, root.name, shown)
    last = text.strip().splitlines()[-1].strip().rstrip(".")
    if unknown := re.match(r'Name "(\w+)" is not defined', last):
        return unknown_name(unknown[1], file, line)
    for pattern, means in MEANINGS.items():
        if found := re.search(pattern, f"{text}\n{shown}"):
            groups = [NODES.get(group, group) for group in found.groups()]
            return means.format(*groups)
    return last


def lacking(of: Any, name: str, text: str) -> str:
    """The text for an attribute that an object does not have.

    Args:
        text: of the line.
    """
    known = list(of.keys) if isinstance(of, Struct) else [n for n in dir(of) if not n.startswith("_")]
    meant = [member for member, words in ALSO.items() if member in known and name.lower() in words.split()]
    near = meant[0] if meant else nearest(name, known)
    guess = f": did you mean {near!r}?" if near else "."
    if isinstance(of, Struct):
        if meant and (found := re.search(rf"([\w.]+)\.{name}\b", text)):
            guess = f": write {found[1]}.{near}."
        return f"the struct has no member {name!r}{guess} It has {', '.join(known)}"
    if isinstance(of, Expr):
        return f"a number of a kernel has no attribute {name!r}: does a function lack @ti.func?"
    what = f"module {of.__name__}" if inspect.ismodule(of) else type(of).__name__
    return f"{what} has no attribute {name!r}{guess}"


def unknown_name(name: str, file: str, line: int) -> str:
    """The text for a name that is not known: where it is known, or a similar name."""
    nodes = list(ast.walk(ast.parse("".join(linecache.getlines(file)))))
    around = [n for n in nodes if isinstance(n, ast.FunctionDef) and n.lineno <= line <= (n.end_lineno or 0)]
    inside = list(ast.walk(around[-1])) if around else []  # of the innermost function
    lines = [n.lineno for n in inside if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store) and n.id == name]
    if lines:
        first = f"{name} is known only in the if or loop of line {min(lines)}"
        return f"{first}: give it a value before, in the block that uses it"
    known = {n.arg for n in inside if isinstance(n, ast.arg)} | {n.name for n in nodes if hasattr(n, "name") and n.name}
    known |= {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    guess = f"tm.{name}" if hasattr(taichi.math, name) else nearest(name, known)
    return f"{name} is not defined{f': did you mean {guess!r}?' if guess else ''}"
