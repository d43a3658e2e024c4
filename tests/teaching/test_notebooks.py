"""Assignments as notebooks: the order of their cells, what is left out of them, and that they run."""

import json
import os
from pathlib import Path

import pytest

import taichi_tracer as tt
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue, notebooks
from taichi_tracer.teaching.handing_out import write_notebook

ONE_LONG = [
    pytest.param("rt3", marks=pytest.mark.slow),
]


def cells_of(name, folder, is_solved=False):
    """Id → source of each cell of code, in their order."""
    (path,) = [p for p in write_notebook(catalogue.load(name), folder, is_solved) if p.suffix == ".ipynb"]
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return {cell["id"]: "".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"}


def test_no_cell_imports_another_one(tmp_path):
    for name in catalogue.names():
        cells = cells_of(name, tmp_path / name)
        stems = {path.stem for path in catalogue.load(name).solution_folder.glob("*.py")}
        for source in cells.values():
            assert not stems & notebooks.imported(source)


def test_a_cell_comes_after_what_it_needs(tmp_path):
    cells = list(cells_of("a2", tmp_path / "n"))
    assert cells.index("sampler") < cells.index("renderer")
    assert cells[-2:] == ["picture", "check-together"]


def test_the_picture_of_the_program_is_a_cell(tmp_path):
    picture = cells_of("a2", tmp_path / "n")["picture"]
    assert picture.startswith("import taichi_tracer as tt\nfrom taichi_tracer.environment import load_environment\n")
    assert picture.endswith("\ntt.teaching.marked(renderer).render(16)")


def test_names_of_imports_stay():
    text = "import numpy\nfrom sampler import BRDF as B, Other\n\nclass A(B):\n    pass\n"
    assert (
        notebooks.without_imports_of(text, {"sampler"}, "x.py") == "import numpy\nB = BRDF\n\nclass A(B):\n    pass\n"
    )
    with pytest.raises(InputError, match=r"x.py:1: a notebook has no file sampler.py: write 'from sampler import"):
        notebooks.without_imports_of("import sampler\n", {"sampler"}, "x.py")
    with pytest.raises(InputError, match="import each other"):
        notebooks.in_order({"a.py": "from b import x", "b.py": "from a import y"})


def test_a_program_without_a_window_has_no_picture():
    assert notebooks.picture_cells("def main():\n    return 0\n", set(), "x.py") == []
    assert notebooks.picture_cells("print(1)\n", set(), "x.py") == []


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


@pytest.mark.usefixtures("_package_first")
@pytest.mark.parametrize("name", ONE_LONG)
def test_the_students_notebook_runs(name, tmp_path):
    """No cell fails: every part is not written, and the picture is a checkerboard."""
    assignment, shown = catalogue.load(name), run(name, tmp_path / "n", is_solved=False)
    told = "\n".join(text for cell, (text, _) in shown.items() if cell.startswith("check-"))
    assert told.count("  not written ") == len(assignment.parts)
    assert "image/png" in shown["picture"][1]
