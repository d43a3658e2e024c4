"""Teachers' notebooks for nbgrader and otter-grader, by the rules of these programs."""

import json
import re

import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.cutting import for_otter, stub_of
from taichi_tracer.teaching.handing_out import write_notebook

BLOCK = re.compile(r"^( *)### BEGIN SOLUTION\n.*?^ *### END SOLUTION\n", re.DOTALL | re.MULTILINE)
HIDDEN = re.compile(r"^### BEGIN HIDDEN TESTS\n.*?^### END HIDDEN TESTS\n", re.DOTALL | re.MULTILINE)
OTTERS = re.compile(r"^ *# BEGIN SOLUTION NO PROMPT\n.*?^ *# END SOLUTION\n", re.DOTALL | re.MULTILINE)


def cells_of(name, folder, grader):
    """The cells of a teacher's notebook."""
    (path,) = [p for p in write_notebook(catalogue.load(name), folder, grader=grader) if p.suffix == ".ipynb"]
    return json.loads(path.read_text(encoding="utf-8"))["cells"]


def text_of(cell) -> str:
    """The source of a cell."""
    return "".join(cell["source"])


@pytest.mark.parametrize("grader", ["nbgrader", "otter"])
@pytest.mark.parametrize("name", catalogue.names())
def test_every_cell_has_a_name_of_its_own(name, grader, tmp_path):
    names = [cell["id"] for cell in cells_of(name, tmp_path / "n", grader)]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[A-Za-z0-9_-]{1,64}", one) for one in names), names


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


@pytest.mark.parametrize("name", catalogue.names())
def test_questions_of_otter_earn_the_points_of_the_assignment(name, tmp_path):
    cells = cells_of(name, tmp_path / "n", "otter")
    raw = [text_of(cell) for cell in cells if cell["cell_type"] == "raw"]
    assert raw[0].startswith("# ASSIGNMENT CONFIG")
    assert raw.count("# BEGIN TESTS") == raw.count("# END TESTS") == raw.count("# END QUESTION")
    points = [float(n) for text in raw for n in re.findall(r"^points: (\S+)", text, re.MULTILINE)]
    tests = [text_of(cell) for cell in cells if text_of(cell).startswith('""" # BEGIN TEST CONFIG')]
    assert sum(points) == catalogue.load(name).points
    assert sum(float(re.search(r"points: (\S+)", text)[1]) for text in tests) == sum(points)
    assert [text.count("hidden: true") for text in tests] == [0, 1] * (len(tests) // 2)


@pytest.mark.parametrize("name", catalogue.names())
def test_what_otter_makes_for_students_is_the_stub(name):
    """It leaves out solutions, and the lines around a prompt."""
    for path in catalogue.load(name).solution_folder.glob("*.py"):
        source = path.read_text(encoding="utf-8")
        lines = OTTERS.sub("", for_otter(source, path.name)).splitlines(keepends=True)
        kept = [line for line in lines if not line.rstrip().endswith(("# BEGIN PROMPT", "# END PROMPT"))]
        assert "".join(kept) == stub_of(source, path.name)


def test_prompts_and_parts_without_one():
    source = "x = 1\n### BEGIN SOLUTION NO PROMPT\ny = 1\n### END SOLUTION\n"
    assert for_otter(source, "a.py").endswith("# BEGIN SOLUTION NO PROMPT\ny = 1\n# END SOLUTION\n")
    assert "PROMPT = " not in for_otter(source, "a.py")


def test_the_command_writes_them(tmp_path, capsys):
    assert main(["assignment", "new", "rt3", str(tmp_path / "a"), "--nbgrader"]) == 0
    assert main(["assignment", "new", "rt3", str(tmp_path / "b"), "--otter"]) == 0
    assert "rt3.ipynb" in capsys.readouterr().out
    assert main(["assignment", "new", "rt3", str(tmp_path / "c"), "--otter", "--nbgrader"]) == 2
    assert not (tmp_path / "c").exists()
