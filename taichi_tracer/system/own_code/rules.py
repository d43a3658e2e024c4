"""Mistakes in functions of kernels that Taichi takes without a word, or that end the process: found in their text."""

import ast
import functools
import inspect
import types
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang.field import Field

from taichi_tracer.system.errors import OwnCodeError
from taichi_tracer.system.own_code.source import fault, gives_nothing, is_own, place, plain, tree_of

ONCE = {"random", "numpy.random", "time", "secrets"}  # modules whose functions run once, when a kernel is compiled
COMPUTES = (ast.BinOp, ast.UnaryOp, ast.Compare, ast.Call, ast.Return, ast.Attribute)
SILENT = {"print", "ti.static_print", "ti.static_assert"}  # what changes nothing
GROWS = {"append", "extend", "insert", "pop", "remove"}  # methods of Python's lists
SIZES = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)  # comparisons that only the kernel can make of its numbers


@functools.cache
def check(function: Callable, owner: type) -> None:
    """Raise an OwnCodeError for the first mistake in a function, or in the own functions that it calls; note the rest.

    Args:
        owner: the class to whose object ``self`` belongs.
    """
    for one in reachable(function, owner):
        for node, call in one.calls():
            one.check_call(node, call)
        one.check_lists()
        one.note_divisions()


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


def reachable(function: Callable, owner: type) -> Iterator["Own"]:
    """A function, and those of Taichi's functions outside of the package that it calls, each once."""
    waiting, seen = [function], set()
    while waiting:
        found = plain(waiting.pop())
        if found in seen or not is_own(found) or tree_of(found) is None:
            continue
        seen.add(found)
        one = Own(found, owner)
        yield one
        waiting += [call for _, call in one.calls() if is_of_taichi(call)]


def runs_once(function: Any) -> bool:
    """Whether a function belongs to a module whose functions run once, when a kernel is compiled."""
    homes = getattr(function, "__module__", None), type(getattr(function, "__self__", None)).__module__
    return any(home in ONCE or str(home).startswith("numpy.random") for home in homes)


def check_whole(what: str, function: Any, owner: type, right: Any = None) -> None:
    """Raise an OwnCodeError if a method has no ``self``, returns nothing and changes nothing, or is wrong in kernels.

    Args:
        what: its name for messages. owner: as for ``check``. right: a method that is right, if one is known.
    """
    if right is not None:
        check_self(what, function, right)
    if local_stores(function) is not None:
        raise fault(function, f"{what} has no return with a value")
    if is_of_taichi(function):
        check(function, owner)


def check_self(what: str, function: Callable, right: Callable) -> None:
    """Raise an OwnCodeError if a method lacks the parameter ``self``."""
    tree, given = tree_of(plain(function)), list(inspect.signature(plain(function)).parameters)
    known = list(inspect.signature(plain(right)).parameters)
    in_class = "." in plain(function).__qualname__.split("<locals>.")[-1]
    is_static = tree is not None and any(getattr(one, "id", "") == "staticmethod" for one in tree.decorator_list)
    is_renamed = len(given) >= len(known) and given[:1] != known[1:2]
    if in_class and not is_static and known[:1] == ["self"] and "self" not in given and not is_renamed:
        raise fault(
            function, f"{what} has no self: write def {plain(function).__name__}({', '.join(['self', *given])})"
        )


def local_stores(function: Any) -> set[str] | None:
    """The names to which a function gives values, if it returns nothing and changes nothing else; otherwise None."""
    tree = tree_of(plain(function))
    if tree is None or not gives_nothing(function):
        return None
    nodes = [node for statement in tree.body for node in ast.walk(statement)]
    stored = [node for node in nodes if isinstance(getattr(node, "ctx", None), ast.Store)]
    roots = {root_of(node) for node in stored if not isinstance(node, (ast.Tuple, ast.List, ast.Starred))}
    own = {a.arg for a in tree.args.args if a.annotation is None and a.arg != "self"}
    own |= {node.id for node in stored if isinstance(node, ast.Name)}
    within = {root_of(node) for node in stored if isinstance(node, (ast.Attribute, ast.Subscript))}
    given = [node for node in nodes if isinstance(node, ast.Assign) and root_of(node.value) == "self"]
    shared = {node.targets[0].id for node in given if isinstance(node.targets[0], ast.Name)}
    shared |= set() if is_of_taichi(function) else {a.arg for a in tree.args.args}
    own -= within & shared  # such as cdf in ``cdf = self.cdf``
    calls = [node.value for node in nodes if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)]
    return roots if roots <= own and all(ast.unparse(call.func) in SILENT for call in calls) else None


def changed_copies(function: Any) -> list[str]:
    """The arguments to which a function that returns nothing gives values, if it changes nothing else."""
    tree = tree_of(plain(function))
    return sorted((local_stores(function) or set()) & {a.arg for a in tree.args.args}) if tree is not None else []


def compares(node: ast.AST, function: ast.FunctionDef) -> bool:
    """Whether a node decides something by comparing numbers that come from the arguments of a function."""
    tests = [node.test] if isinstance(node, (ast.If, ast.While, ast.IfExp)) else []
    tests += node.values if isinstance(node, ast.BoolOp) else []
    inside = [one for test in tests for one in ast.walk(test) if isinstance(one, ast.Compare)]
    sizes = [one for one in inside if any(isinstance(op, SIZES) for op in one.ops)]
    own = {a.arg for a in function.args.args if a.arg != "self"}
    stored = (one for one in ast.walk(function) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store))
    own |= {one.id for one in stored}
    return any(isinstance(name, ast.Name) and name.id in own for one in sizes for name in ast.walk(one))


def root_of(node: ast.AST) -> str:
    """The name at the beginning of ``name.member[index]``; "" where there is none."""
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def is_of_taichi(function: Any) -> bool:
    """Whether a function, or what a class holds of it, has @ti.func."""
    return hasattr(getattr(function, "__func__", function), "_is_taichi_function")


class Own:
    """A function that somebody has written.

    Args:
        function: without decorators. owner: the class to which ``self`` belongs.
    """

    def __init__(self, function: Callable, owner: type) -> None:
        tree = tree_of(function)
        assert tree is not None
        self.function, self.owner, self.tree = function, owner, tree
        self.parents = {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}
        closure = inspect.getclosurevars(function)
        self.names: dict[str, Any] = {**closure.builtins, **closure.globals, **closure.nonlocals}

    @functools.cached_property
    def _calls(self) -> list[tuple[ast.Call, Any]]:
        body = [node for statement in self.tree.body for node in ast.walk(statement)]
        return [(node, self.meant(node.func)) for node in body if isinstance(node, ast.Call)]

    def calls(self) -> list[tuple[ast.Call, Any]]:
        """Each call, with what it calls; None where that is not known."""
        return self._calls

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

    def fails(self, node: ast.AST, text: str) -> OwnCodeError:
        """The error at a node."""
        return fault(self.function, text, node)

    def is_static(self, node: ast.AST) -> bool:
        """Whether a node stands in what Taichi decides while the kernel is read: in ti.static."""
        while node in self.parents:
            node = self.parents[node]
            heads = [getattr(node, "test", None), getattr(node, "iter", None), node]
            if any(isinstance(head, ast.Call) and getattr(head.func, "attr", "") == "static" for head in heads):
                return True
        return False

    # ── the mistakes ──

    def check_call(self, node: ast.Call, function: Any) -> None:
        """A function that gives nothing where a value is needed; one that lacks @ti.func; one that runs only once."""
        name = ast.unparse(node.func)
        if function is not None and runs_once(function):
            advice = "a sample takes rng.next_1d(), and other kernels ti.random()"
            warnings.warn(
                f"{place(self.function, node)}: {name} runs once, while the kernel is compiled: {advice}", stacklevel=2
            )
        self.check_numpy(node, name)
        if function is None or not is_own(function) or tree_of(plain(function)) is None:
            return
        if is_of_taichi(function):
            is_used = not isinstance(self.parents.get(node), ast.Expr)
            if is_used and gives_nothing(function):
                text = f"{name} has no return with a value, and {place(self.function, node)} needs one"
                raise fault(function, text)
            if not is_used and (lost := changed_copies(function)):
                text = f"{name} changes only its own copy of {', '.join(lost)}: let it return the new value"
                warnings.warn(f"{place(self.function, node)}: {text}", stacklevel=2)
        elif inspect.isfunction(function) and self.needs_func(node, function):
            raise fault(function, f"{name} is called in a kernel: write @ti.func above it")

    def check_numpy(self, node: ast.Call, name: str) -> None:
        """A function of numpy that gets a value of ``self`` or of a parameter."""
        home = self.names.get(root_of(node.func))
        values = {"self", *(a.arg for a in self.tree.args.args if a.annotation is None)}
        given = [one for argument in node.args for one in ast.walk(argument) if root_of(one) in values]
        in_kernel = any(ast.unparse(one).endswith(("func", "kernel")) for one in self.tree.decorator_list)
        if home is not np or hasattr(ti, name.rpartition(".")[2]) or not given or not in_kernel or self.is_static(node):
            return
        text, last = ast.unparse(node.args[0]), name.rpartition(".")[2]
        is_value = isinstance(node.args[0], ast.Attribute) and text.startswith("self.")
        advice = f"use tm.{last}" if hasattr(tm, last) else "use what taichi.math has"
        advice = f"use {text}{'[None]' * is_value}" if last in ("array", "asarray") else advice
        raise self.fails(node, f"{name} is a function of Python, and this runs in a kernel: {advice}")

    def needs_func(self, node: ast.Call, function: Callable) -> bool:
        """Whether a plain function decides something by values that only the kernel knows."""
        tree = tree_of(plain(function))
        given = [*node.args, *(keyword.value for keyword in node.keywords)]
        is_known = all(isinstance(one, ast.Constant) for one in given) or self.is_static(node)
        if is_known or tree is None or hasattr(function, "is_for_python_too"):
            return False
        return any(compares(one, tree) for one in ast.walk(tree))

    def check_lists(self) -> None:
        """A list of Python that grows in a loop of the kernel, which is read once."""
        for node in ast.walk(self.tree):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in GROWS):
                continue
            loops = [one for one in self.above(node) if isinstance(one, (ast.For, ast.While, ast.If))]
            if loops and isinstance(node.func.value, ast.Name) and not self.is_static(node):
                name = node.func.value.id
                text = f"the list {name} does not grow in a kernel: write {name} = ti.Vector([0.0, 0.0, 0.0])"
                raise self.fails(node, f"{text}, and {name}[k] = ... in the loop")

    def above(self, node: ast.AST) -> Iterator[ast.AST]:
        """The nodes in which a node stands."""
        while node in self.parents:
            node = self.parents[node]
            yield node

    def note_divisions(self) -> None:
        """``1 // 2``, which is 0."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.FloorDiv):
                a, b = (getattr(side, "value", None) for side in (node.left, node.right))
                if isinstance(a, int) and isinstance(b, int) and b != 0 and a % b != 0:
                    text = f"{a} // {b} is {a // b}: {a} / {b} is {a / b:g}"
                    warnings.warn(f"{place(self.function, node)}: {text}", stacklevel=2)
