"""Teachers' notebooks for nbgrader and otter-grader, by the rules of these programs."""

import json
import re

import pytest

from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.handout.export import write_notebook

BLOCK = re.compile(r"^( *)### BEGIN SOLUTION\n.*?^ *### END SOLUTION\n", re.DOTALL | re.MULTILINE)
HIDDEN = re.compile(r"^### BEGIN HIDDEN TESTS\n.*?^### END HIDDEN TESTS\n", re.DOTALL | re.MULTILINE)


def cells_of(name, folder, grader):
    """The cells of a teacher's notebook."""
    (path,) = [p for p in write_notebook(catalogue.load(name), folder, grader=grader) if p.suffix == ".ipynb"]
    return json.loads(path.read_text(encoding="utf-8"))["cells"]


def text_of(cell) -> str:
    """The source of a cell."""
    return "".join(cell["source"])


@pytest.mark.parametrize("name", catalogue.names())
def test_cells_of_nbgrader_earn_the_points_of_the_assignment(name, tmp_path):
    cells = cells_of(name, tmp_path / "n", "nbgrader")
    facts = [(text_of(cell), cell["metadata"].get("nbgrader", {})) for cell in cells]
    graded = [(text, found) for text, found in facts if found.get("grade")]
    written = [text for text, found in facts if found.get("solution")]
    assert sum(found["points"] for _, found in graded) == catalogue.load(name).points
    assert all(found["locked"] and not found["solution"] and found["schema_version"] == 3 for _, found in graded)
    assert all("seed=1" not in HIDDEN.sub("", text) and "seed=1" in text for text, _ in graded)
    assert len(written) == len(catalogue.load(name).files)
    assert all(BLOCK.search(text) for text in written)
