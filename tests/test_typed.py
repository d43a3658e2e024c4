"""Editors and type checkers see the public interface: its names, its signatures, and a misspelt option."""

import ast
import inspect
from pathlib import Path

import pytest

import taichi_tracer as tt

INIT = ast.parse(Path(tt.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))


def imported() -> dict[str, str]:
    """Name → module of the imports that only editors read."""
    froms = [node for node in ast.walk(INIT) if isinstance(node, ast.ImportFrom)]
    return {a.asname: node.module for node in froms for a in node.names if a.asname is not None}


def test_editors_see_the_names_that_the_package_exports():
    lazy = {name: f"taichi_tracer.{module}" for name, module in tt._HOME_OF.items()}
    assert imported() == lazy | dict.fromkeys(tt._PACKAGES, "taichi_tracer")


def python_functions(name: str):
    """The public functions and methods of a public name that Python calls: not those of kernels."""
    value = getattr(tt, name)
    if not isinstance(value, type):
        members = {name: value} if inspect.isfunction(value) else {}
    else:
        members = {n: inspect.getattr_static(value, n) for n in dir(value) if n == "__init__" or n[0] != "_"}
    for member, found in members.items():
        function = found.fget if isinstance(found, property) else getattr(found, "__func__", found)
        is_ours = inspect.isfunction(function) and function.__module__.startswith("taichi_tracer.")
        if is_ours and not hasattr(function, "_is_taichi_function") and not hasattr(function, "_is_wrapped_kernel"):
            yield f"{name}.{member}" if member != name else name, function


FUNCTIONS = dict(pair for name in tt.__all__ for pair in python_functions(name)) | {
    "studies.accuracy": tt.studies.accuracy
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_signature_is_annotated_and_spells_its_options_out(name):
    signature = inspect.signature(FUNCTIONS[name])
    parameters = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
    assert [p.name for p in parameters if p.annotation is p.empty] == []
    assert [p.name for p in parameters if p.kind is p.VAR_POSITIONAL] == []
    assert [p.name for p in parameters if p.kind is p.VAR_KEYWORD and "Unpack[" not in str(p.annotation)] == []
    assert signature.return_annotation is not signature.empty


# ── a type checker reads programs ──
