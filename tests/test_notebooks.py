"""The notebooks run from top to bottom as they are, and are kept without outputs."""

import os
import re
from itertools import pairwise
from pathlib import Path

import pytest

import taichi_tracer as tt

nbclient = pytest.importorskip("nbclient", reason="the extra [test] is not installed")
import nbformat  # noqa: E402  it comes with nbclient

NOTEBOOKS = sorted((Path(__file__).parents[1] / "docs" / "notebooks").glob("*.ipynb"))


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 11  # the first picture, and ten chapters


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.name)
def test_notebooks_are_kept_without_outputs(path):
    for cell in nbformat.read(path, as_version=4).cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


CHAPTERS = re.findall(r"\(notebooks/(\w+\.ipynb)\)", (NOTEBOOKS[0].parents[1] / "chapters.md").read_text("utf-8"))[:10]


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_chapter_has_exercises_with_folded_answers_and_a_part_of_ones_own(name):
    cells = nbformat.read(NOTEBOOKS[0].parent / name, as_version=4).cells
    text = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    folded = text.count("<details><summary>Answer</summary>") + sum(
        "hide-cell" in c.metadata.get("tags", ()) for c in cells
    )
    asked = text.count("**Exercise") + text.count("**Try it:**")
    assert asked >= folded >= 2
    assert "## What you write is what runs" in text
    assert any(cell.cell_type == "code" and re.search(r"^class \w+\(\w+", cell.source, re.MULTILINE) for cell in cells)


def test_the_chapters_lead_from_one_to_the_next():
    for name, following in pairwise(CHAPTERS):
        assert f"]({following})" in (NOTEBOOKS[0].parent / name).read_text("utf-8"), name


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


def outputs_of(*cells: str, folder: Path) -> list[list]:
    """The outputs of each cell of a new notebook, run in a new kernel."""
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    resources = {"metadata": {"path": folder}}
    nbclient.NotebookClient(notebook, timeout=120, resources=resources, allow_errors=True).execute()
    return [cell.outputs for cell in notebook.cells]


def test_the_first_cell_shows_nothing_in_red_and_errors_are_shown(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(tt.__file__).parents[1]))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for name in ("TI_LOG_LEVEL", "TI_SKIP_VERSION_CHECK", "ENABLE_TAICHI_HEADER_PRINT"):
        monkeypatch.delenv(name, raising=False)
    first, log, wrong = outputs_of(
        "import taichi_tracer as tt\ntt.init()\ncamera = tt.Camera(4, 4)",
        "import os\nprint('TI_LOG_LEVEL' in os.environ)",
        "tt.init(arch='gpu')",
        folder=tmp_path,
    )
    assert [out.text for out in first if out.get("name") == "stderr"] == []
    assert "Taichi" not in "".join(out.get("text", "") for out in first)
    assert "".join(out.text for out in log) == "False\n"  # the user's environment is as it was
    assert [out.ename for out in wrong if out.output_type == "error"] == ["InputError"]
