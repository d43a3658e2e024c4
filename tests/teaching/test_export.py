"""The folders and notebooks that students get: complete, without the solution, and of code that runs."""

import ast
import json
import re

import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import NOT_WRITTEN
from taichi_tracer.teaching.handout.export import write_folder, write_notebook
from taichi_tracer.teaching.running import answer, load_submission

NAMES = catalogue.names()
BLOCK = re.compile(r"^ *### BEGIN SOLUTION$.*?^ *### END SOLUTION$", re.MULTILINE | re.DOTALL)


pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Name → (a student's folder, the solved one, a notebook's folder)."""
    root, made = tmp_path_factory.mktemp("handed_out"), {}
    for name in NAMES:
        assignment = catalogue.load(name)
        made[name] = tuple(root / f"{name}{kind}" for kind in ("", "_solved", "_notebook"))
        write_folder(assignment, made[name][0])
        write_folder(assignment, made[name][1], is_solved=True)
        write_notebook(assignment, made[name][2])
    return made


def statements(source: str) -> set[str]:
    """The syntax trees of all statements of a text, without those that stand in any program."""
    tree = ast.parse(source)
    return {ast.dump(node) for node in ast.walk(tree) if isinstance(node, (ast.Assign, ast.AugAssign, ast.For, ast.If))}


@pytest.mark.parametrize("name", NAMES)
def test_nothing_of_the_solution_is_in_what_students_get(folders, name):
    """Neither its lines, nor its statements; in the folder and in the notebook."""
    assignment = catalogue.load(name)
    given = {path.name: path.read_text(encoding="utf-8") for path in folders[name][0].glob("*.py")}
    cells = json.loads(next(folders[name][2].glob("*.ipynb")).read_text(encoding="utf-8"))["cells"]
    notebook = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    for path in (assignment.folder / "solution").glob("*.py"):
        source = path.read_text(encoding="utf-8")
        blocks = [block.splitlines()[1:-1] for block in BLOCK.findall(source)]
        lines = {line.strip() for block in blocks for line in block if len(line.strip()) > 12}
        solution = {s for block in blocks for s in statements("if True:\n" + "\n".join(block))}
        # A solution may repeat a line that is given, such as v = tm.vec3(0).
        around = "\n".join(
            BLOCK.sub("", p.read_text(encoding="utf-8")) for p in (assignment.folder / "solution").glob("*.py")
        )
        lines -= {line.strip() for line in around.splitlines()}
        solution -= statements(around)
        assert path.name == assignment.program or lines
        for text in (given[path.name], notebook):
            assert not lines & {line.strip() for line in text.splitlines()}
            assert not solution & statements(text)


@pytest.mark.parametrize("name", NAMES)
def test_every_method_with_a_part_is_a_stub(folders, name):
    assignment = catalogue.load(name)
    student = load_submission(folders[name][0], assignment)
    assert student.errors == {}
    for part in assignment.parts:
        found = answer(assignment, part, student, assignment.inputs(part, 0))
        assert found.status == NOT_WRITTEN, part.name
        if part.replaces:
            source = (folders[name][0] / assignment.classes[part.replaces]).read_text(encoding="utf-8")
            assert f'not_written("{part.name}")' in source.splitlines()[found.line - 1]


def test_nothing_is_written_over_a_students_work(tmp_path, capsys):
    (tmp_path / "camera.py").write_text("mine")
    with pytest.raises(InputError, match="nothing is written over it"):
        write_folder(catalogue.load("a1"), tmp_path)
    assert main(["assignment", "new", "a1", str(tmp_path)]) == 2
    assert "give a new folder" in capsys.readouterr().err
    assert (tmp_path / "camera.py").read_text() == "mine"
