"""Mistakes in functions of kernels that Taichi accepts silently, or that end the process: found in their text."""

import ast
import functools
import inspect
import types
import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang.field import Field

from taichi_tracer.system.own_code.source import fault, gives_nothing, is_own, place, tree_of, unwrap

ONCE = ("random", "numpy.random", "time", "secrets")  # modules whose functions run once, when a kernel is compiled
COMPUTES = (ast.BinOp, ast.UnaryOp, ast.Compare, ast.Call, ast.Return, ast.Attribute)
SILENT = {"print", "ti.static_print", "ti.static_assert"}  # what changes nothing
SIZES = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)  # comparisons that only the kernel can make of its numbers
CONSTANTS = (int, float, str, bool, tuple)
Values = tuple[tuple[str, Any], ...]


@functools.cache
def check(function: Callable, owner: type) -> None:
    """Raise an OwnCodeError for the first mistake in a function, or in the own functions that it calls.

    Args:
        owner: the class to whose object ``self`` belongs.
    """
    waiting, seen = [function], set()
    while waiting:
        found = unwrap(waiting.pop())
        tree = tree_of(found) if is_own(found) else None
        if found in seen or tree is None:
            continue
        seen.add(found)
        one = OwnFunction(found, tree, owner)
        for node, call in one.calls():
            one.check_call(node, call)
            if is_of_taichi(call):
                waiting.append(call)


def check_fields(function: Callable, of: Any) -> None:
    """Raise an OwnCodeError if a method computes with a field of its object that has one element, without [None]."""
    tree = tree_of(function) if is_own(function) and not isinstance(of, (int, float)) else None
    for node in ast.walk(tree) if tree is not None and tree.args.args[:1] else ():
        for used in ast.iter_child_nodes(node) if isinstance(node, COMPUTES) else ():
            if isinstance(used, ast.Attribute) and getattr(used.value, "id", "") == "self":
                field = getattr(of, used.attr, None)
                is_read = not isinstance(node, ast.Attribute) or not hasattr(field, node.attr)
                is_read &= not isinstance(node, ast.Call) or ast.unparse(node.func).startswith(("tm.", "ti."))
                if isinstance(field, Field) and field.shape == () and is_read:
                    raise fault(function, f"write self.{used.attr}[None]", used)


def check_whole(what: str, function: Any, owner: type, right: Any) -> None:
    """Raise an OwnCodeError if a method has no ``self``, lacks a value to return, or is wrong in kernels.

    Args:
        what: its name for messages. owner: as for ``check``. right: a method that is right; None if none is known.
    """
    if right is not None:
        check_self(what, function, right)
    if gives_nothing(function) and not changes_others(function):
        raise fault(function, f"{what} has no return with a value")
    if is_of_taichi(function):
        check(function, owner)


def check_self(what: str, function: Callable, right: Callable) -> None:
    """Raise an OwnCodeError if a method lacks the parameter ``self``."""
    name, given, known = unwrap(function).__name__, parameters(function), parameters(right)
    is_method = "." in unwrap(function).__qualname__.split("<locals>.")[-1]
    is_renamed = len(given) >= len(known) and given[:1] != known[1:2]
    if is_method and known[:1] == ["self"] and "self" not in given and not is_renamed and not is_static(function):
        raise fault(function, f"{what} has no self: write def {name}({', '.join(['self', *given])})")


def parameters(function: Callable) -> list[str]:
    """The names of the parameters of a function or method."""
    return list(inspect.signature(unwrap(function)).parameters)


def is_static(function: Callable) -> bool:
    """Whether a function is a static method."""
    tree = tree_of(unwrap(function))
    return tree is not None and any(getattr(one, "id", "") == "staticmethod" for one in tree.decorator_list)


def changes_others(function: Any) -> bool:
    """Whether a function writes into ``self`` or into an argument, or calls something for its effect."""
    tree = tree_of(unwrap(function))
    nodes = [node for statement in tree.body for node in ast.walk(statement)] if tree is not None else []
    stored = [node for node in nodes if isinstance(getattr(node, "ctx", None), ast.Store)]
    own = {node.id for node in stored if isinstance(node, ast.Name)} | {""}
    own -= {ast.unparse(n.targets[0]) for n in nodes if isinstance(n, ast.Assign) and root_of(n.value) == "self"}
    calls = {ast.unparse(n.value.func) for n in nodes if isinstance(n, ast.Expr) and isinstance(n.value, ast.Call)}
    return not {root_of(node) for node in stored if not isinstance(node, ast.Name)} <= own or not calls <= SILENT


def root_of(node: ast.AST) -> str:
    """The name at the beginning of ``name.member[index]``; "" where there is none."""
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def is_of_taichi(function: Any) -> bool:
    """Whether a function, or what a class holds of it, has @ti.func."""
    return hasattr(getattr(function, "__func__", function), "_is_taichi_function")


def runs_once(function: Any) -> bool:
    """Whether a function belongs to a module whose functions run once, when a kernel is compiled."""
    homes = getattr(function, "__module__", None), type(getattr(function, "__self__", None)).__module__
    return any(str(home).startswith(ONCE) for home in homes)


def compares(node: ast.AST, names: set[str]) -> bool:
    """Whether a node decides something by comparing numbers of some names."""
    tests = node.values if isinstance(node, ast.BoolOp) else [getattr(node, "test", node)]
    inside = [one for test in tests for one in ast.walk(test) if isinstance(one, ast.Compare)]
    sizes = [one for one in inside if any(isinstance(op, SIZES) for op in one.ops)]
    return any(isinstance(name, ast.Name) and name.id in names for one in sizes for name in ast.walk(one))


class OwnFunction:
    """A function that somebody has written.

    Args:
        function: without decorators. tree: its syntax. owner: the class to which ``self`` belongs.
    """

    def __init__(self, function: Callable, tree: ast.FunctionDef, owner: type) -> None:
        self.function, self.owner, self.tree = function, owner, tree
        self.parents: dict[ast.AST | None, ast.AST] = {
            child: node for node in ast.walk(self.tree) for child in ast.iter_child_nodes(node)
        }
        closure = inspect.getclosurevars(function)
        self.names: dict[str, Any] = {**closure.builtins, **closure.globals, **closure.nonlocals}

    def calls(self) -> Iterator[tuple[ast.Call, Any]]:
        """Each call, with what it calls; None where that is not known."""
        body = [node for statement in self.tree.body for node in ast.walk(statement)]
        return ((node, self.meant(node.func)) for node in body if isinstance(node, ast.Call))

    def meant(self, node: ast.AST) -> Any:
        """The function or module that an expression names; None if it is not known before the kernel runs."""
        if isinstance(node, ast.Name):
            return self.names.get(node.id)
        if not isinstance(node, ast.Attribute):
            return None
        if isinstance(node.value, ast.Name) and node.value.id == "self":
            found = inspect.getattr_static(self.owner, node.attr, None)
            return found if is_of_taichi(found) or inspect.isfunction(found) else None
        base = self.meant(node.value)
        return getattr(base, node.attr, None) if isinstance(base, types.ModuleType) else None

    def is_static(self, node: ast.AST | None) -> bool:
        """Whether a node belongs to what Taichi decides while the kernel is read: in ti.static."""
        while node := self.parents.get(node):
            heads = [getattr(node, "test", None), getattr(node, "iter", None), node]
            if any(isinstance(head, ast.Call) and getattr(head.func, "attr", "") == "static" for head in heads):
                return True
        return False

    def check_call(self, node: ast.Call, function: Any) -> None:
        """A function that gives nothing where a value is needed; one that lacks @ti.func; one that runs only once."""
        name = ast.unparse(node.func)
        if function is not None and runs_once(function):
            text = f"{name} runs once, while the kernel is compiled: a sample takes rng.next_1d(), others ti.random()"
            warnings.warn(f"{place(self.function, node)}: {text}", stacklevel=2)
        self.check_numpy(node, name)
        if function is None or not is_own(function):
            return
        if is_of_taichi(function):
            if gives_nothing(function) and not isinstance(self.parents.get(node), ast.Expr):
                text = f"{name} has no return with a value, and {place(self.function, node)} needs one"
                raise fault(function, text)
        elif inspect.isfunction(function) and self.needs_func(node, function):
            raise fault(function, f"{name} is called in a kernel: write @ti.func above it")

    def check_numpy(self, node: ast.Call, name: str) -> None:
        """A function of numpy that gets a value of ``self`` or of a parameter."""
        last, text = name.rpartition(".")[2], ast.unparse(node.args[0]) if node.args else ""
        values = {"self", *(a.arg for a in self.tree.args.args if a.annotation is None)}
        is_given = any(root_of(one) in values for argument in node.args for one in ast.walk(argument))
        in_kernel = any(ast.unparse(one).endswith(("func", "kernel")) for one in self.tree.decorator_list)
        is_numpys = self.names.get(root_of(node.func)) is np and not hasattr(ti, last)
        if is_numpys and is_given and in_kernel and not self.is_static(node):
            advice = f"use tm.{last}" if hasattr(tm, last) else "use what taichi.math has"
            if last in ("array", "asarray"):
                advice = f"use {text}{'[None]' * text.startswith('self.')}"
            raise fault(self.function, f"{name} is a function of Python, and this runs in a kernel: {advice}", node)

    def needs_func(self, node: ast.Call, function: Callable) -> bool:
        """Whether a plain function decides something by values that only the kernel knows."""
        tree = tree_of(unwrap(function))
        given = [*node.args, *(keyword.value for keyword in node.keywords)]
        is_known = all(isinstance(one, ast.Constant) for one in given) or self.is_static(node)
        if is_known or tree is None or hasattr(function, "is_for_python_too"):
            return False
        stored = (one for one in ast.walk(tree) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store))
        names = {a.arg for a in tree.args.args if a.arg != "self"} | {one.id for one in stored}
        decides = (ast.If, ast.While, ast.IfExp, ast.BoolOp)
        return any(compares(one, names) for one in ast.walk(tree) if isinstance(one, decides))


def values_of(parts: Iterable[Any]) -> Values:
    """("Mine.scale", value) of each attribute that the kernels of own parts read as a constant."""
    found = []
    for part in parts:
        cls = part if isinstance(part, type) else type(part)
        read = {name: getattr(part, name, None) for name in names_read(cls)}
        found += [(f"{cls.__name__}.{name}", value) for name, value in read.items() if isinstance(value, CONSTANTS)]
    return tuple(found)


@functools.cache
def names_read(cls: type) -> tuple[str, ...]:
    """The attributes of ``self`` that somebody's functions in a class read inside kernels; none of the package's."""
    own = [unwrap(value) for base in cls.__mro__ for value in vars(base).values() if is_of_taichi(value)]
    nodes = [node for one in own if is_own(one) for node in ast.walk(tree_of(one) or ast.Pass())]
    return tuple(sorted({n.attr for n in nodes if isinstance(n, ast.Attribute) and ast.unparse(n.value) == "self"}))


def note_change(former: Values, present: Values) -> None:
    """Warn of the values that have changed since a kernel was compiled."""
    before = dict(former)
    changed = [name for name, value in present if before.get(name, value) != value]
    if changed:
        text = f"{', '.join(changed)} changed: the picture begins again, and its kernel is compiled again"
        warnings.warn(f"{text}; a ti.field changes without that", stacklevel=3)
