"""What a submission's process gets of an assignment: nothing of the solution but what was already asked for.

A method is tested beside the solution's methods that it may call. So parts are asked for in the order of ``in_order``:
first those that call no other one. Beside a part stand the solution's methods of the parts before it, which are judged
by then. Its own method is not in the process, and neither are those that come later.
"""

import ast
import shutil
from collections.abc import Collection
from pathlib import Path

from taichi_tracer.teaching.base import Assignment
from taichi_tracer.teaching.cutting import methods_by_line, partly_solved


def in_order(assignment: Assignment) -> tuple[str, ...]:
    """The names of the parts of methods: those that call no other one first, then those that call these, and so on."""
    methods = [part.name for part in assignment.parts if part.replaces]
    if assignment.is_sealed:
        return tuple(methods)
    calls = called(assignment)
    heights = dict.fromkeys(calls, 0)
    for _ in calls:  # no chain of calls is longer; a circle ends here
        heights = {name: max((heights[other] + 1 for other in others), default=0) for name, others in calls.items()}
    return tuple(sorted(methods, key=lambda name: heights.get(name, 0)))


def called(assignment: Assignment) -> dict[str, set[str]]:
    """Method or function of the solution → those that it calls, as far as their names tell: "Class.method"."""
    used: dict[str, set[str]] = {}
    for file in assignment.files:
        tree = ast.parse((assignment.solution_folder / file).read_text(encoding="utf-8"))
        for top in tree.body:
            owner = f"{top.name}." if isinstance(top, ast.ClassDef) else ""
            for node in top.body if isinstance(top, ast.ClassDef) else [top]:
                if isinstance(node, ast.FunctionDef):
                    within = list(ast.walk(node))
                    names = {one.attr for one in within if isinstance(one, ast.Attribute)}
                    used[owner + node.name] = names | {one.id for one in within if isinstance(one, ast.Name)}
    last = {name: name.rpartition(".")[2] for name in used}
    return {name: {other for other in used if last[other] in words and other != name} for name, words in used.items()}


def solved_parts(assignment: Assignment, known: Collection[str]) -> dict[str, str]:
    """File → its text with the solution of some parts alone, and of what these call; files without any are left out."""
    calls, shown = called(assignment), set(known)
    parts = {part.name for part in assignment.parts}
    waiting = list(known)
    while waiting:
        new = calls.get(waiting.pop(), set()) - shown - parts
        shown |= new
        waiting += new
    texts = {}
    for file in assignment.files:
        path = assignment.solution_folder / file
        source = path.read_text(encoding="utf-8")
        if shown & set(methods_by_line(source, str(path)).values()):
            texts[file] = partly_solved(source, str(path), shown | {""})  # what stands outside of methods, too
    return texts


def write(assignment: Assignment, folder: Path) -> None:
    """Write the assignment into a new folder, with stubs in place of the solution, and without the known mistakes."""
    folder.mkdir(parents=True)
    for path in (*assignment.folder.glob("*.py"), assignment.folder / "README.md"):
        if path.name != "mistakes.py":
            shutil.copyfile(path, folder / path.name)
    (folder / "solution").mkdir()
    for path in assignment.solution_folder.glob("*.py"):
        text = partly_solved(path.read_text(encoding="utf-8"), str(path), ())
        (folder / "solution" / path.name).write_text(text, encoding="utf-8")
