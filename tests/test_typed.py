"""Editors and type checkers see the public interface: its names, its signatures, and a misspelt option."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import taichi_tracer as tt
from taichi_tracer.studies import variants

ROOT = Path(__file__).parents[1]
INIT = ast.parse(Path(tt.__file__).read_text(encoding="utf-8"))


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


def test_public_functions_were_found():
    assert {"load_scene_data", "A1Renderer.__init__", "Camera.set_camera_parameters", "studies.accuracy"} <= set(
        FUNCTIONS
    )


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_signature_is_annotated_and_spells_its_options_out(name):
    signature = inspect.signature(FUNCTIONS[name])
    parameters = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
    assert [p.name for p in parameters if p.annotation is p.empty] == []
    assert [p.name for p in parameters if p.kind is p.VAR_POSITIONAL] == []
    assert [p.name for p in parameters if p.kind is p.VAR_KEYWORD and "Unpack[" not in str(p.annotation)] == []
    assert signature.return_annotation is not signature.empty


def defaults(function) -> dict[str, object]:
    """Parameter → default."""
    return {p.name: p.default for p in inspect.signature(function).parameters.values()}


def test_the_study_takes_every_knob():
    knobs = set(defaults(variants.plan)) - {"knobs"}
    assert {*variants.USUAL, *knobs} <= set(defaults(tt.studies.accuracy))


# ── a type checker reads programs ──


def checked(*paths: Path) -> subprocess.CompletedProcess:
    """What mypy says of files, with the settings of pyproject.toml; with none, of the public interface."""
    pytest.importorskip("mypy", reason="mypy is not installed: .ci/run installs it")
    command = [sys.executable, "-m", "mypy", "--no-error-summary", "--hide-error-context", *map(str, paths)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)


@pytest.mark.long
def test_the_public_interface_and_a_students_program_have_the_right_types():
    result = checked()
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr


@pytest.mark.long
def test_a_type_checker_finds_every_mistake():
    path = ROOT / "tests" / "typed" / "wrong.py"
    wanted = {n: line.split("  # ")[1] for n, line in enumerate(path.read_text().splitlines(), 1) if "  # " in line}
    told: dict[int, str] = {}
    for number, message in re.findall(r"wrong\.py:(\d+): error: (.*)", checked(path).stdout):
        told[int(number)] = told.get(int(number), "") + message
    assert sorted(told) == sorted(wanted)
    assert [n for n, words in wanted.items() if words not in told[n]] == []
