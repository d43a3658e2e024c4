"""Writes an assignment as one notebook: a cell for each file, a check after it, and a picture in the end.

The cells of a notebook share their names. So a cell needs no import of what another cell defines, and such imports
are left out. A file that needs another one comes after it.
"""

import ast
import json
import textwrap
from collections.abc import Callable, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import graded_cells
from taichi_tracer.teaching.base import Assignment, Part
from taichi_tracer.teaching.catalogue import SHIPPED
from taichi_tracer.teaching.graded_cells import Cell, code, markdown

SAMPLES = 16  # of the picture in the end


def notebook(
    assignment: Assignment, word: str, texts: Mapping[str, str], readme: str, seed: int, grader: str = ""
) -> dict:
    """The JSON of a notebook of format 4.5; nbgrader knows the cells to be written by a student.

    Args:
        word: what ``check`` takes to find the assignment. texts: name → text of every Python file. readme: the task.
        grader: for which program a teacher's notebook is, "nbgrader" or "otter"; see ``graded_cells``.

    Raises:
        InputError: two files need each other, or a file imports another one as a whole.
    """
    tested = {part.replaces for part in assignment.parts if part.replaces}
    hidden_seed = seed + 1 if assignment.folder.parent == SHIPPED else seed  # others have the answers of one seed
    cells = [*graded_cells.head(grader, assignment.name), markdown("text", readme)]
    stems = {name.removesuffix(".py") for name in texts}
    for name in in_order({name: texts[name] for name in assignment.files}):
        classes = [cls for cls, file in assignment.classes.items() if file == name and cls in tested]
        stem = name.removesuffix(".py")
        written = code(stem, without_imports_of(texts[name], stems, name), is_written_by_student=True)
        if grader:
            parts = [part for part in assignment.parts if part.replaces in classes and not part.is_optional]
            cells += graded_cells.question(
                grader, written, stem, parts, call_of(word, seed), call_of(word, hidden_seed)
            )
            continue
        cells.append(written)
        if classes:
            cells.append(check_cell(f"check-{stem}", word, classes, seed))
    if assignment.program:
        cells += picture_cells(texts[assignment.program], stems, assignment.program)
    together = [part.name for part in assignment.parts if part.replaces == ""]
    if grader:
        pictures = [part for part in assignment.parts if part.replaces == ""]
        classes = [cls for cls in assignment.classes if cls in tested]
        calls = call_of(word, seed, classes), call_of(word, hidden_seed, classes)
        cells += graded_cells.question(grader, None, "pictures", pictures, *calls) if pictures else []
    elif together and len({assignment.classes[cls] for cls in tested}) > 1:  # otherwise, one check has them all
        classes = [cls for cls in assignment.classes if cls in tested]
        cells.append(check_cell("check-together", word, classes, seed, together))
    metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    return {"cells": cells, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


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
    found = {node.module or "" for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)}
    whole = (alias.name for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import) for alias in node.names)
    return found | set(whole)


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
    tree = ast.parse(text)
    main = next((node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "main"), None)
    shown = window_of(main)
    if main is None or shown is None:
        return []
    imports = [node for node in tree.body if isinstance(node, (ast.Import, ast.ImportFrom))]
    used = {node.id for statement in main.body[:-1] for node in ast.walk(statement) if isinstance(node, ast.Name)}
    used |= {node.id for node in ast.walk(shown) if isinstance(node, ast.Name)}
    needed = [node for node in imports if used & {alias.asname or alias.name for alias in node.names}]
    body = [node for node in main.body[:-1] if not is_text(node)]
    sources = [ast.get_source_segment(text, node, padded=True) or "" for node in (*needed, *body)]
    last = f"{ast.get_source_segment(text, shown)}.render({SAMPLES})"
    lines = [textwrap.dedent(source) for source in sources]
    return [markdown("picture-text", "## Your picture"), code("picture", "\n".join([*lines, last]))]


def call_of(word: str, seed: int, classes: Sequence[str] = ()) -> Callable[[Part], str]:
    """Part → the call that checks it.

    Args:
        classes: that it needs; () is the one that it tests.
    """

    def call(part: Part) -> str:
        words = [json.dumps(word), *(classes or [part.replaces]), f"seed={seed}", f"parts={json.dumps([part.name])}"]
        return f"tt.teaching.check({', '.join(words)})"

    return call


def check_cell(name: str, word: str, classes: Sequence[str], seed: int, parts: Sequence[str] = ()) -> Cell:
    """A check of some classes; of some parts alone, if they are named."""
    words = [json.dumps(word), *classes]
    words += [f"seed={seed}"] * bool(seed) + [f"parts={json.dumps(list(parts))}"] * bool(parts)
    return code(name, f"tt.teaching.check({', '.join(words)})")


def window_of(main: ast.FunctionDef | None) -> ast.expr | None:
    """The renderer of the last line ``return show(renderer)``."""
    last = main.body[-1] if main is not None else None
    call = last.value if isinstance(last, ast.Return) else None
    is_show = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "show"
    return call.args[0] if is_show and len(call.args) == 1 else None  # type: ignore[union-attr]


def is_text(node: ast.stmt) -> bool:
    """Whether a statement is a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
