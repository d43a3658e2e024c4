"""The first notebook runs from top to bottom as it is."""

import os
from pathlib import Path

import pytest

import taichi_tracer as tt

nbclient = pytest.importorskip("nbclient", reason="the extra [test] is not installed")
import nbformat  # noqa: E402  it comes with nbclient

FIRST = Path(__file__).parents[1] / "docs" / "notebooks" / "first_picture.ipynb"


@pytest.mark.slow
def test_the_first_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(tt.__file__).parents[1]) + os.pathsep + os.environ.get("PYTHONPATH", ""))
    notebook = nbformat.read(FIRST, as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": tmp_path}}).execute()
    shown = [kind for cell in notebook.cells for out in cell.get("outputs", []) for kind in out.get("data", {})]
    assert "image/png" in shown  # a renderer shows itself
    assert "text/html" in shown  # a hit table shows itself
    errors = [out for cell in notebook.cells for out in cell.get("outputs", []) if out.output_type == "error"]
    assert errors == []
