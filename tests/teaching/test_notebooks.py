"""Assignments as notebooks: the order of their cells, what is left out of them, and that they run."""

import os
from pathlib import Path

import pytest

import taichi_tracer as tt
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.handout.export import write_notebook

ONE_LONG = [
    pytest.param("rt3", marks=pytest.mark.slow),
]


def run(name, folder, is_solved):
    """Id → (texts, kinds of what it shows) of each cell of code, after the notebook was run."""
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    (path,) = [p for p in write_notebook(catalogue.load(name), folder, is_solved) if p.suffix == ".ipynb"]
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    shown = {}
    for cell in notebook.cells:
        if cell.cell_type == "code":
            data = [output.get("data", {}) for output in cell.outputs]
            kinds = {kind for one in data for kind in one}
            shown[cell.id] = "\n".join(one.get("text/plain", "") for one in data), kinds
    return shown


@pytest.fixture
def _package_first(monkeypatch, tmp_path):
    """The process of the notebook finds this package, and keeps nothing."""
    monkeypatch.setenv("PYTHONPATH", str(Path(tt.__file__).parents[1]) + os.pathsep + os.environ.get("PYTHONPATH", ""))
    monkeypatch.setenv("TAICHI_TRACER_CACHE", str(tmp_path / "cache"))


@pytest.mark.usefixtures("_package_first")
@pytest.mark.parametrize("name", ONE_LONG)
def test_the_solved_notebook_runs(name, tmp_path):
    """From the first cell to the last: every part is right, and the picture is shown."""
    assignment, shown = catalogue.load(name), run(name, tmp_path / "n", is_solved=True)
    checks = [text for cell, (text, _) in shown.items() if cell.startswith("check-")]
    rows = [line.split() for text in checks for line in text.splitlines() if line.startswith("  ")]
    assert [row for row in rows if row[0] != "right"] == []
    assert len(rows) == len(assignment.parts)
    assert "image/png" in shown["picture"][1]
    assert all("text/html" in kinds for cell, (_, kinds) in shown.items() if cell.startswith("check-"))
