"""Editors and type checkers see the public interface: its names, its signatures, and a misspelt option."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import taichi_tracer as tt
from taichi_tracer.studies import variants

ROOT = Path(__file__).parents[1]
INIT = ast.parse(Path(tt.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))


def imported() -> dict[str, str]:
    """Name → module of the imports that only editors read."""
    froms = [node for node in ast.walk(INIT) if isinstance(node, ast.ImportFrom)]
    return {a.asname: node.module for node in froms for a in node.names if a.asname is not None}


def test_editors_see_the_names_that_the_package_exports():
    lazy = {name: f"taichi_tracer.{module}" for name, module in tt._HOME_OF.items()}
    assert imported() == lazy | dict.fromkeys(tt._PACKAGES, "taichi_tracer")


def completed(text: str) -> set[str]:
    """What IPython and Jupyter offer at the end of a text, by jedi, where ``tt`` is imported."""
    jedi = pytest.importorskip("jedi")
    return {one.name for one in jedi.Interpreter(text, [{"tt": tt}]).complete() if not one.name.startswith("_")}


def test_a_notebook_offers_the_public_names_and_nothing_else():
    assert completed("tt.") == {name for name in dir(tt) if not name.startswith("_")}
    assert {"render", "image", "error", "explain", "receipt"} <= completed("tt.A4Renderer.")
    assert {"intersect", "occluded", "receipt"} <= completed("tt.SceneData.")


def test_an_editor_offers_the_methods_of_what_is_made_in_a_file():
    jedi = pytest.importorskip("jedi")
    text = "import taichi_tracer as tt\nscene = tt.load_scene_data('cube')\ntt.A4Renderer(scene)."
    found = {one.name for one in jedi.Script(text, project=jedi.Project(ROOT)).complete()}
    assert {"render", "image", "error", "max_bounces"} <= found
    found = {
        one.name for one in jedi.Script(text.rpartition("tt.")[0] + "scene.", project=jedi.Project(ROOT)).complete()
    }
    assert {"intersect", "occluded"} <= found


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
