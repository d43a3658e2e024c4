"""Writes an assignment as one notebook: a cell for each file, a check after it, and a picture in the end.

The cells of a notebook share their names. So a cell needs no import of what another cell defines, and such imports
are left out. A file that needs another one comes after it.

A teacher's notebook for nbgrader or otter-grader has the solution between its tags. Both programs make the students'
version of it, without the solution, and give points for the cells behind it. nbgrader takes a number that a cell
returns as its points, an error as none; a test of otter-grader is passed, or not. Checks with another seed are hidden
from students.
"""

import ast
import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_raw_cell

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Assignment, Part
from taichi_tracer.teaching.catalogue import SHIPPED

SAMPLES = 16  # of the picture in the end
MAIN = re.compile(  # of a program such as A1.py: what it does before it shows a renderer in a window
    r'^def main\(\).*\n(    """.*"""\n)?(?P<steps>(    .*\n|\n)*)    return show\((?P<shown>.*)\)$', re.MULTILINE
)
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}
GRADED = {"grade": False, "locked": False, "schema_version": 3, "solution": False, "task": False}  # what nbgrader reads
Cell = nbformat.NotebookNode


def notebook(
    assignment: Assignment, word: str, texts: Mapping[str, str], readme: str, seed: int, grader: str = ""
) -> str:
    """The text of a notebook of format 4.5.

    Args:
        word: what ``check`` takes to find the assignment. texts: name → text of every Python file. readme: the task.
        grader: for which program a teacher's notebook is, "nbgrader" or "otter".

    Raises:
        InputError: two files need each other, or a file imports another one as a whole.
    """
    # The checks of an assignment that is not in the package have the answers of one seed.
    checks = Checks(word, seed, seed + 1 if assignment.folder.parent == SHIPPED else seed)
    with_checks = {"nbgrader": checks.for_nbgrader, "otter": checks.for_otter}.get(grader, checks.for_student)
    tested = [cls for cls in assignment.classes if any(part.replaces == cls for part in assignment.parts)]
    config = f"# ASSIGNMENT CONFIG\nname: {assignment.name}\ninit_cell: false"
    cells = [new_raw_cell(config, id="assignment")] if grader == "otter" else []
    cells.append(new_markdown_cell(readme, id="text"))
    stems = {name.removesuffix(".py") for name in texts}
    for name in in_order({name: texts[name] for name in assignment.files}):
        stem, classes = name.removesuffix(".py"), [cls for cls in tested if assignment.classes[cls] == name]
        parts = [part for part in assignment.parts if part.replaces in classes and not part.is_optional]
        written = code(stem, without_imports_of(texts[name], stems, name), solution=True)
        cells += with_checks(stem, [written], parts, classes)
    if assignment.program:
        cells += picture_cells(texts[assignment.program], stems, assignment.program)
    pictures = [part for part in assignment.parts if part.replaces == ""]
    if pictures and (grader or len({assignment.classes[cls] for cls in tested}) > 1):  # otherwise, one check has all
        cells += with_checks("pictures", [], pictures, tested)
    return nbformat.writes(new_notebook(cells=cells, metadata={"kernelspec": KERNEL})) + "\n"


def code(name: str, source: str, **facts: object) -> Cell:
    """A cell of code, with what nbgrader is to know about it; without facts, it is not nbgrader's."""
    metadata = {"nbgrader": GRADED | {"grade_id": name} | facts} if facts else {}
    return new_code_cell(source.rstrip(), id=name, metadata=metadata)


@dataclass(frozen=True)
class Checks:
    """Makes the cells that check methods, which follow the cell that was written; without one, all files were written.

    Attributes:
        word: what ``check`` takes to find the assignment. seed, hidden_seed: for students, and for points.
    """

    word: str
    seed: int
    hidden_seed: int

    def call(self, seed: int, classes: Sequence[str], parts: Sequence[Part] = ()) -> str:
        """The call that checks some classes; of some parts alone, if there are any."""
        words = [json.dumps(self.word), *classes, *[f"seed={seed}"] * bool(seed)]
        words += [f"parts={json.dumps([part.name for part in parts])}"] * bool(parts)
        return f"tt.teaching.check({', '.join(words)})"

    def calls(self, part: Part, classes: Sequence[str]) -> tuple[str, str]:
        """The calls that check one part, for students and for points."""
        needed = [part.replaces] if part.replaces else classes
        return self.call(self.seed, needed, [part]), self.call(self.hidden_seed, needed, [part])

    def for_student(self, name: str, written: list[Cell], parts: Sequence[Part], classes: Sequence[str]) -> list[Cell]:
        """One cell that checks all parts of these classes."""
        return written + [code(f"check-{name}", self.call(self.seed, classes, () if written else parts))] * bool(
            classes
        )

    def for_nbgrader(self, name: str, written: list[Cell], parts: Sequence[Part], classes: Sequence[str]) -> list[Cell]:
        """A cell for each part, which earns its points."""
        cells = list(written)
        for part in parts:
            shown, hidden = self.calls(part, classes)
            source = (
                f"report = {shown}\n### BEGIN HIDDEN TESTS\nreport = {hidden}\n### END HIDDEN TESTS\n"
                "display(report)\nreport.score()"
            )
            cells.append(code(identifier(part), source, grade=True, locked=True, points=part.points))
        return cells

    def for_otter(self, name: str, written: list[Cell], parts: Sequence[Part], classes: Sequence[str]) -> list[Cell]:
        """A question: the solution, and for each part a test that is shown and a hidden one, which has its points."""
        if not parts:
            return written
        points = sum(part.points for part in parts)
        cells = [new_raw_cell(f"# BEGIN QUESTION\nname: {name}\npoints: {points:g}", id=f"{name}-question")]
        if written:
            begin = new_raw_cell("# BEGIN SOLUTION", id=f"{name}-solution")
            cells += [begin, *written, new_raw_cell("# END SOLUTION", id=f"{name}-end")]
        cells.append(new_raw_cell("# BEGIN TESTS", id=f"{name}-tests"))
        for part in parts:
            shown, hidden = self.calls(part, classes)
            for kind, call, earned in (("shown", shown, 0.0), ("hidden", hidden, part.points)):
                config = f"hidden: {str(kind == 'hidden').lower()}\npoints: {earned:g}"
                text = f'''""" # BEGIN TEST CONFIG\n{config}\n""" # END TEST CONFIG\nassert {call}.is_right'''
                cells.append(code(f"{identifier(part)}-{kind}", text))
        cells.append(new_raw_cell("# END TESTS", id=f"{name}-tests-end"))
        return [*cells, new_raw_cell("# END QUESTION", id=f"{name}-question-end")]


def identifier(part: Part) -> str:
    """The name of a part as the name of a cell: letters, digits and dashes."""
    return re.sub(r"[^A-Za-z0-9]+", "-", part.name)


def in_order(texts: Mapping[str, str]) -> list[str]:
    """The names of files, each after those that it imports; otherwise in their own order."""
    needs = {name: {f"{stem}.py" for stem in imported(text)} & set(texts) for name, text in texts.items()}
    try:
        return list(TopologicalSorter(needs).static_order())
    except CycleError as error:
        raise InputError(
            f"{' and '.join(dict.fromkeys(error.args[1]))} import each other: a notebook has an order"
        ) from None


def imported(text: str) -> set[str]:
    """The modules that a file imports by ``from … import``, or as a whole."""
    nodes = list(ast.walk(ast.parse(text)))
    whole = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return whole | {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}


def without_imports_of(text: str, stems: set[str], file: str) -> str:
    """A file without its imports of the other files; a name that it gives to what it imports stays its name.

    Raises:
        InputError: it imports another file as a whole, so that its names would be missing.
    """
    lines = text.splitlines(keepends=True)
    for node in reversed(ast.parse(text).body):
        if isinstance(node, ast.Import) and stems & {alias.name for alias in node.names}:
            name = next(alias.name for alias in node.names if alias.name in stems)
            raise InputError(f"{file}:{node.lineno}: a notebook has no file {name}.py: write 'from {name} import ...'")
        if isinstance(node, ast.ImportFrom) and node.module in stems:
            renamed = [f"{alias.asname} = {alias.name}\n" for alias in node.names if alias.asname]
            lines[node.lineno - 1 : node.end_lineno] = renamed
    return "".join(lines)


def picture_cells(program: str, stems: set[str], file: str) -> list[Cell]:
    """What the program shows in its window, as a picture; nothing if its ``main`` does not end with ``show(...)``."""
    text = without_imports_of(program, stems, file)
    main = MAIN.search(text)
    if main is None:
        return []
    imports = [
        line for line in text.splitlines() if line.startswith(("import ", "from ")) and "import show" not in line
    ]
    source = "\n".join([*imports, textwrap.dedent(main["steps"]) + f"{main['shown']}.render({SAMPLES})"])
    return [new_markdown_cell("## Your picture", id="picture-text"), code("picture", source)]
