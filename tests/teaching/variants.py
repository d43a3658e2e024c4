"""Right solutions that are written differently, as five students would write them.

A file of ``solutions/`` has what one student writes for one assignment. It is read as text: a test puts each method in
the place of the solution's.
"""

import ast
from pathlib import Path

from taichi_tracer.teaching import catalogue

FOLDER = Path(__file__).parent / "solutions"


def methods(name: str, source: str) -> dict[str, str]:
    """Part → the body of its method, and the helpers below it: the methods that are no part of the assignment."""
    parts = {part.name for part in catalogue.load(name).parts}
    lines = source.splitlines(keepends=True)
    found = {}
    for cls in ast.parse(source).body:
        for method in cls.body if isinstance(cls, ast.ClassDef) else []:
            if f"{cls.name}.{method.name}" in parts:
                part, first = f"{cls.name}.{method.name}", method.body[0].lineno - 1
            found[part] = "".join(lines[first : method.end_lineno])
    return found


def of_assignment(name: str) -> dict[str, dict[str, str]]:
    """Student → the methods that are written."""
    files = {file.stem.rpartition("_"): file for file in sorted(FOLDER.glob("*.py"))}
    of_this = {student: file for (assignment, _, student), file in files.items() if assignment == name}
    return {student: methods(name, file.read_text(encoding="utf-8")) for student, file in of_this.items()}


VARIANTS = {name: of_assignment(name) for name in catalogue.names()}
