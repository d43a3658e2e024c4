"""The notebooks run from top to bottom as they are, and are kept without outputs."""

import os
from pathlib import Path

import pytest

import taichi_tracer as tt

nbclient = pytest.importorskip("nbclient", reason="the extra [test] is not installed")
import nbformat  # noqa: E402  it comes with nbclient

NOTEBOOKS = sorted((Path(__file__).parents[1] / "docs" / "notebooks").glob("*.ipynb"))


def is_quick(path):
    return path.name == "first_picture.ipynb"


ONE_QUICK = [path for path in NOTEBOOKS if is_quick(path)]


@pytest.mark.parametrize("path", ONE_QUICK, ids=lambda p: p.name)
def test_notebooks_run(path, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(tt.__file__).parents[1]) + os.pathsep + os.environ.get("PYTHONPATH", ""))
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": tmp_path}}).execute()
    shown = [kind for cell in notebook.cells for out in cell.get("outputs", []) for kind in out.get("data", {})]
    assert "image/png" in shown  # a renderer shows itself
    if is_quick(path):
        assert "text/html" in shown  # a hit table shows itself
    errors = [out for cell in notebook.cells for out in cell.get("outputs", []) if out.output_type == "error"]
    assert errors == []
