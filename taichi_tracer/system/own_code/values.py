"""Numbers that somebody's own parts have, and that their kernels read: constants of a kernel, until they change."""

import ast
import functools
import warnings
from collections.abc import Iterable
from typing import Any

from taichi_tracer.system.own_code.interface import is_packages, vars_of
from taichi_tracer.system.own_code.rules import is_of_taichi
from taichi_tracer.system.own_code.source import tree_of

CONSTANTS = (int, float, str, bool, tuple)
Values = tuple[tuple[str, Any], ...]


def values_of(parts: Iterable[Any]) -> Values:
    """("Mine.scale", value) of each attribute that the functions of own parts read as a constant."""
    found = []
    for part in parts:
        cls = part if isinstance(part, type) else type(part)
        for name in names_read(cls):
            value = getattr(part, name, None)
            if isinstance(value, CONSTANTS):
                found.append((f"{cls.__name__}.{name}", value))
    return tuple(found)


@functools.cache
def names_read(cls: type) -> tuple[str, ...]:
    """The attributes of ``self`` that somebody's functions in a class read inside kernels; none of the package's."""
    if is_packages(cls):
        return ()
    trees = [tree_of(function) for function in vars_of(cls).values() if is_of_taichi(function)]
    nodes = [node for tree in trees if tree is not None for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    return tuple(sorted({n.attr for n in nodes if isinstance(n.value, ast.Name) and n.value.id == "self"}))


def note_change(former: Values, present: Values) -> None:
    """Note which values have changed since a kernel was compiled."""
    before = dict(former)
    changed = [name for name, value in present if before.get(name, value) != value]
    if changed:
        text = f"{', '.join(changed)} changed: the picture begins again, and its kernel is compiled again"
        warnings.warn(f"{text}; a ti.field changes without that", stacklevel=3)
