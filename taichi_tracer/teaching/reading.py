"""Students' files: read as Python reads them, without what belongs to the kit, and names that are taken."""

import ast
import contextlib
import functools
import inspect
import sys
import textwrap
import types
from pathlib import Path

from taichi_tracer.system.errors import InputError

KIT = "taichi_tracer.teaching"
FOR_STUDENTS = {f"{KIT}.not_written", f"{KIT}.check"}
NOT_UTF8 = "the file is not in UTF-8: save it so, or name its encoding in its first line, as in # coding: latin-1"


def module_of(file: Path) -> types.ModuleType:
    """Run a file as the module of its name, without a cached bytecode beside it."""
    if file.stem in sys.modules:
        return sys.modules[file.stem]
    module = types.ModuleType(file.stem)
    module.__file__ = str(file)
    sys.modules[file.stem] = module
    try:
        exec(compiled(file), module.__dict__)
    except BaseException:
        sys.modules.pop(file.stem, None)
        raise
    return module


def compiled(file: Path) -> types.CodeType:
    """The code of a student's file, in UTF-8, with a mark or without, or in the encoding that a line names.

    Raises:
        SyntaxError: the code, or its encoding, is wrong.
        InputError: it imports what belongs to the kit.
    """
    raw = file.read_bytes()  # Python finds the encoding of bytes
    try:
        tree = ast.parse(raw, str(file))
    except (SyntaxError, ValueError):
        is_utf8 = b"\0" not in raw
        with contextlib.suppress(UnicodeDecodeError):
            raw.decode("utf-8")
            if is_utf8:
                raise
        raise SyntaxError(NOT_UTF8) from None
    if found := sorted(imports_of_the_kit(tree)):
        raise InputError(f"{found[0]} belongs to the kit that judges: a solution cannot import it")
    return compile(tree, str(file), "exec")


def imports_of_the_kit(tree: ast.AST) -> set[str]:
    """What a file imports of ``taichi_tracer.teaching``, but for what is made for students."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == KIT:
            found |= {f"{KIT}.{alias.name}" for alias in node.names} - FOR_STUDENTS
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            found |= {name for name in names if name.startswith(f"{KIT}.")}
    return found


def taken_name(cls: type, own: set[str]) -> tuple[str, type] | None:
    """A method of a student's class whose name is that of a value of the package's class, which would hide it.

    Args:
        own: the names of the class's own methods.

    Returns:
        The name, and the package's class; None if there is no such method.
    """
    for base in cls.__mro__:
        if base.__module__.startswith("taichi_tracer.") and not base.__module__.startswith(KIT):
            for name in sorted(own & values_of(base)):
                return name, base
    return None


@functools.cache
def values_of(base: type) -> frozenset[str]:
    """The names that the methods of a class give to values of an object: ``self.name = …``."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(base)))
    except (OSError, TypeError, SyntaxError):
        return frozenset()
    of_self = (n for n in ast.walk(tree) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store))
    return frozenset(n.attr for n in of_self if isinstance(n.value, ast.Name) and n.value.id == "self")
