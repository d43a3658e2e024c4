"""Functions and classes that somebody has written outside of the package: their text, and mistakes in it.

Found are mistakes in functions of kernels that Taichi accepts silently, or that end the process; methods of a class
that lack, that are misspelt, or that cannot be called as the package calls them; and results of another kind than is
needed. ``overridable(eval="vec3", pdf="number")`` says in the class that defines the methods what they must return. A
kind is "number", "truth", "vec2", "vec3", the name of a struct, or several of them with spaces between: a method then
returns as many values.
"""

import ast
import difflib
import functools
import inspect
import linecache
import os
import sys
import textwrap
import types
import warnings
import weakref
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import taichi
from taichi.lang.expr import Expr
from taichi.lang.matrix import Matrix
from taichi.lang.struct import Struct

from taichi_tracer.system.errors import OwnCodeError

PACKAGE = f"{Path(__file__).resolve().parents[2]}{os.sep}"  # how the names of the package's own files begin
LIBRARIES = (
    PACKAGE,
    os.path.dirname(str(taichi.__file__)),
    f"{os.sep}site-packages{os.sep}",
    os.path.dirname(os.__file__),
)


def unwrap(function: Any) -> Any:
    """The Python function, without the decorators around it."""
    function = getattr(function, "written", function)
    function = getattr(function, "__func__", function)
    while hasattr(function, "__wrapped__"):
        function = function.__wrapped__
    return function


def is_own_file(file: str) -> bool:
    """Whether a file belongs neither to the package nor to another library."""
    return not file.startswith("<") and not any(library in file for library in LIBRARIES)


def is_own(function: Callable) -> bool:
    """Whether a function stands in a file of somebody's own; the adapters to a student's functions do not."""
    code = getattr(unwrap(function), "__code__", None)
    return code is not None and is_own_file(code.co_filename)


@functools.cache
def tree_of(function: Callable) -> ast.FunctionDef | None:
    """The syntax tree of a function, with the line numbers of its file; None where its text is unknown."""
    try:
        lines, first = inspect.getsourcelines(unwrap(function))
        tree = ast.parse(textwrap.dedent("".join(lines)))
    except (OSError, TypeError, SyntaxError):
        return None
    if not isinstance(tree.body[0], ast.FunctionDef):  # such as a lambda
        return None
    ast.increment_lineno(tree, first - 1)
    return tree.body[0]


def line_of(function: Callable, node: ast.AST | None = None) -> int:
    """The line of a function, or of a node of its tree."""
    tree = tree_of(function)
    return getattr(node, "lineno", unwrap(function).__code__.co_firstlineno if tree is None else tree.lineno)


def place(function: Callable, node: ast.AST | None = None) -> str:
    """Where a function stands, or a node of its tree, as "my_parts.py:12"."""
    return shown_place(unwrap(function).__code__.co_filename, line_of(function, node))


def fault(function: Callable, text: str, node: ast.AST | None = None) -> OwnCodeError:
    """The error for a function, or for a node of its tree."""
    return fault_at(unwrap(function).__code__.co_filename, line_of(function, node), text)


def fault_at(file: str, line: int, text: str) -> OwnCodeError:
    """The error for a line of a file."""
    return OwnCodeError(f"{shown_place(file, line)}: {text}", text, file, line)


def shown_place(file: str, line: int) -> str:
    """A file and a line, as messages show them: from the present folder, or the number of a notebook's cell."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    named = getattr(getattr(shell, "compile", None), "format_code_name", lambda name: None)(file)
    if named is not None:
        return f"{' '.join(named)}, line {line}"
    here = f"{os.getcwd()}{os.sep}"
    return f"{file.removeprefix(here)}:{line}"


def parameters(function: Any) -> list[inspect.Parameter]:
    """The parameters of a function or method, without ``self``."""
    return [p for p in inspect.signature(unwrap(function)).parameters.values() if p.name != "self"]


def what_it_says(function: Callable) -> str:
    """The first sentence of what the package writes about a method, without the full stop."""
    text = " ".join((inspect.getdoc(unwrap(function)) or "what the package's method does").split("\n\n")[0].split())
    return text.split(". ")[0].rstrip(".").replace("``", "")


def returns(tree: ast.FunctionDef) -> list[ast.Return]:
    """The return statements of a function that give a value."""
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Return) and node.value is not None]
    return [node for node in found if not (isinstance(node.value, ast.Constant) and node.value.value is None)]


def gives_nothing(function: Callable) -> bool:
    """Whether a function certainly returns no value; False where its text is unknown."""
    tree = tree_of(function)
    return tree is not None and not returns(tree) and not any(isinstance(n, ast.Yield) for n in ast.walk(tree))


def is_empty(function: Callable) -> bool:
    """Whether the body of a function is only ``pass``, ``...``, a docstring, or ``return None``."""
    tree = tree_of(function)
    if tree is None:
        return False
    words = [one for one in tree.body if not (isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant))]
    return all(isinstance(one, ast.Pass | ast.Return) for one in words) and not returns(tree)


# ── what methods must return ──


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
WITHOUT_INDEX = ": a field of one element is written with [None]"
CURES = {  # (what is returned, the kind that is needed) → what to write
    ("a number", "vec2"): ": tm.vec2(x) has the number in each component",
    ("a number", "vec3"): ": tm.vec3(x) has the number in each component",
    ("2 values", "vec2"): ": write tm.vec2(a, b)",
    ("3 values", "vec3"): ": write tm.vec3(a, b, c)",
    ("a vec2", "number"): ONE_NUMBER,
    ("a vec3", "number"): ONE_NUMBER,
    ("True or False", "number"): ": ti.select(condition, a, b) chooses one",
    ("a ScalarArray", "number"): WITHOUT_INDEX,
    ("a MatrixArray", "vec3"): WITHOUT_INDEX,
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


# ── mistakes in functions ──


ONCE = ("random", "numpy.random", "time", "secrets")  # modules whose functions run once, when a kernel is compiled
CONSTANTS = (int, float, str, bool, tuple)
SILENT = {"print", "ti.static_print", "ti.static_assert"}  # what changes nothing
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
        for node in one.calls:
            call = one.meant(node.func)
            one.check_call(node, call)
            if is_of_taichi(call):
                waiting.append(call)


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
    own, tree = unwrap(function), tree_of(unwrap(function))
    given, known = (list(inspect.signature(unwrap(one)).parameters) for one in (function, right))
    is_static = tree is not None and "staticmethod" in map(ast.unparse, tree.decorator_list)
    is_method = "." in own.__qualname__.split("<locals>.")[-1] and not is_static
    is_renamed = len(given) >= len(known) and given[:1] != known[1:2]
    if is_method and known[:1] == ["self"] and "self" not in given and not is_renamed:
        raise fault(function, f"{what} has no self: write def {own.__name__}({', '.join(['self', *given])})")


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


class OwnFunction:
    """A function that somebody has written.

    Args:
        function: without decorators. tree: its syntax. owner: the class to which ``self`` belongs.
    """

    def __init__(self, function: Callable, tree: ast.FunctionDef, owner: type) -> None:
        self.function, self.owner, self.tree = function, owner, tree
        body = [node for statement in tree.body for node in ast.walk(statement)]
        self.calls = [node for node in body if isinstance(node, ast.Call)]
        self.unused = {node.value for node in body if isinstance(node, ast.Expr)}  # values that nobody takes
        closure = inspect.getclosurevars(function)
        self.names: dict[str, Any] = {**closure.builtins, **closure.globals, **closure.nonlocals}

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

    def check_call(self, node: ast.Call, function: Any) -> None:
        """A function that gives nothing where a value is needed; one that runs only once."""
        name = ast.unparse(node.func)
        homes = getattr(function, "__module__", None), type(getattr(function, "__self__", None)).__module__
        if any(str(home).startswith(ONCE) for home in homes):
            text = f"{name} runs once, while the kernel is compiled: a sample takes rng.next_1d(), others ti.random()"
            warnings.warn(f"{place(self.function, node)}: {text}", stacklevel=2)
        if function is None or not is_own(function):
            return
        if is_of_taichi(function) and gives_nothing(function) and node not in self.unused:
            raise fault(function, f"{name} has no return with a value, and {place(self.function, node)} needs one")


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


# ── a class, compared with the package's class ──


DRAWN = {"xi", "rng", "jitter", "within"}  # arguments that a method may leave out: it draws its numbers itself
LIKE = 0.75  # how similar a misspelt name is to the right one, as ``difflib`` measures it


def check_class(cls: type, required: tuple[str, ...], file: str = "") -> None:
    """Raise an OwnCodeError if a class lacks a method that it must define.

    Args:
        required: the names of these methods. file: where the class is written, if that is known.
    """
    if is_packages(cls):
        return
    for name in required:
        found = inspect.getattr_static(cls, name)
        function = getattr(found, "written", found)
        if not is_own(function) and is_left_open(function):
            near = difflib.get_close_matches(name, own_names(cls), n=1, cutoff=0.6)
            guess = f": is {near[0]!r} misspelt?" if near else "."
            arguments = ", ".join(["self", *(p.name for p in parameters(function))])
            text = f"{cls.__name__} lacks {name}({arguments}){guess} It gives: {what_it_says(function)}"
            raise fault_at(*place_of(cls, file), text)


@functools.cache
def note_misspelt(cls: type, known: tuple[str, ...]) -> None:
    """Warn, once, of methods that nobody calls, and whose names are nearly those of the package's methods.

    Args:
        known: the names of the package's methods that a class may replace.
    """
    own = vars_of(cls)
    called = {name for function in own.values() for name in unwrap(function).__code__.co_names}
    for name in {*own_names(cls)} - called - {*known}:
        near = difflib.get_close_matches(name, {*known} - {*own}, n=1, cutoff=LIKE)
        if near:
            text = f"{place(own[name])}: nothing calls {cls.__name__}.{name}: did you mean {near[0]!r}?"
            warnings.warn(text, stacklevel=2)


def is_packages(cls: type) -> bool:
    """Whether a class and all its methods stand in the package."""
    return all(base.__module__.split(".")[0] in ("taichi_tracer", "builtins") for base in cls.__mro__)


def vars_of(cls: type) -> dict[str, Any]:
    """The methods that somebody has written in a class and in its bases: name → function."""
    found: dict[str, Any] = {}
    for base in reversed(cls.__mro__):
        found |= {n: v for n, v in vars(base).items() if hasattr(unwrap(v), "__code__") and is_own(v)}
    return found


def own_names(cls: type) -> list[str]:
    """Names of methods that somebody has added, and that the package's classes do not have."""
    packages = [base for base in cls.__mro__ if base.__module__.split(".")[0] == "taichi_tracer"]
    return [n for n in vars_of(cls) if not n.startswith("_") and not any(n in vars(base) for base in packages)]


def place_of(cls: type, file: str = "") -> tuple[str, int]:
    """The file and the line of a class."""
    own = [unwrap(function) for function in vars_of(cls).values()]
    file = own[0].__code__.co_filename if own else file
    text = "".join(linecache.getlines(file)).partition(f"class {cls.__name__}")[0]
    return file or cls.__module__, text.count("\n") + 1


@functools.cache
def is_left_open(function: Callable) -> bool:
    """Whether the package's method only says what a subclass must write."""
    names = unwrap(function).__code__.co_names
    return "static_assert" in names or "NotImplementedError" in names


@functools.cache
def check_method(owner: type, name: str, function: Callable, shipped: Callable, gives: str) -> None:
    """Raise an OwnCodeError if what somebody has written cannot take the place of a method of the package.

    Args:
        owner: the class for which it was written. function: what was written, as the class holds it.
        shipped: the package's method. gives: the kind of what it returns; "" if any is right.
    """
    if not is_own(function):
        return
    what = unwrap(function).__qualname__.split("<locals>.")[-1]
    if gives and is_plain_python(function):
        raise fault(function, f"{what} runs in kernels: write @ti.func above it")
    is_kernel = hasattr(getattr(function, "__func__", function), "_is_wrapped_kernel")
    if hasattr(unwrap(shipped), "__code__") and not is_kernel:  # a kernel may write a field instead
        check_parameters(what, function, shipped)
        if not is_plain_python(function) and gives_nothing(function) and not gives_nothing(shipped):
            raise fault(function, f"{what} has no return with a value. It gives: {what_it_says(shipped)}")
    check(function, owner)
    if gives:
        expected[unwrap(function)] = what, gives


def check_parameters(what: str, function: Callable, shipped: Callable) -> None:
    """Raise an OwnCodeError if the package cannot call a function as it calls its own."""
    given, wanted = parameters(function), parameters(shipped)
    if any(p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) for p in given):
        return
    check_self(what, function, shipped)
    names, known = [p.name for p in given], [p.name for p in wanted]
    needed = [p for p in wanted if p.name not in DRAWN and p.default is p.empty]
    least = [p.name for p in given if p.default is p.empty]
    why = ""
    if len(least) > len(known):
        why = f"{', '.join(least[len(known) :])} comes from nowhere"
    elif len(names) < len(needed):
        why = f"it takes only {', '.join(names) or 'self'}"
    elif names != known and sorted(names) == sorted(known):
        why = f"its arguments stand in another order, {', '.join(names)}"
    if why:
        raise fault(function, f"{what} is called as {what}({', '.join(known)}), but {why}")


def is_plain_python(function: Any) -> bool:
    """Whether a function is neither one of Taichi nor one that may be called in kernels; a formula in a lambda may."""
    inner = getattr(function, "__func__", function)
    marks = "_is_taichi_function", "_is_wrapped_kernel", "is_for_python_too"
    is_marked = any(hasattr(inner, mark) for mark in marks)
    return inspect.isfunction(inner) and inner.__name__ != "<lambda>" and not is_marked
