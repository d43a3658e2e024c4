"""Imports and code of a submission that the rules of an assignment do not allow: a report that a teacher reads.

It reads the syntax tree. ``getattr`` and many other ways hide code from it, see docs/teaching_security.md.
"""

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path

from taichi_tracer.teaching.grading.submissions import shown
from taichi_tracer.teaching.student_import import imports_of_the_kit

ALWAYS_ALLOWED = ("__future__", "abc", "dataclasses", "enum", "math", "numpy", "taichi", "taichi_tracer", "typing")
ROUND_THE_RULE = ("__import__", "eval", "exec", "compile", "globals", "vars", "getattr", "__builtins__", "__loader__")
ROUND_THE_RULE += ("__subclasses__", "__globals__", "__closure__", "__code__", "__dict__", "__mro__", "_getframe")


def check_imports(folder: Path, solution: Path, files: Sequence[str], methods: dict[str, set[str]]) -> list[str]:
    """What goes against the rule "no imports beyond those provided", or round it, one sentence each.

    Args:
        folder: the student's. solution: the folder of the solution, whose imports are allowed.
        files: what is handed in.
        methods: class → its methods that the student writes; the package's must not be called instead.
    """
    allowed = {*ALWAYS_ALLOWED, *(path.stem for path in folder.glob("*.py"))}
    for file in sorted(solution.glob("*.py")):
        allowed |= {name.partition(".")[0] for name in imported(ast.parse(file.read_text(encoding="utf-8")))}
    findings = []
    for file in files:
        path = folder / file
        try:
            tree = ast.parse(path.read_bytes())
        except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):  # the report says so when it is run
            continue
        foreign = {name for name in imported(tree) if name.partition(".")[0] not in allowed}
        findings += [f"{file} imports {shown(name)}" for name in sorted(foreign | imports_of_the_kit(tree))]
        own = {path.stem for path in folder.glob("*.py")}
        findings += [f"{file}: {text}" for text in sorted(set(suspicious_code(tree, methods, own)))]
    return findings


def imported(tree: ast.AST) -> set[str]:
    """The modules that a file imports."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module or "")
    return names


def suspicious_code(tree: ast.AST, methods: dict[str, set[str]], own: set[str]) -> Iterator[str]:
    """Ways round the rule that the syntax tree shows, one sentence each.

    Args:
        own: the names of the student's files, without ".py".
    """
    written = {node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    for node in (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)):
        if (node.module or "").removeprefix("taichi_tracer.") in own:  # as files of the course import each other
            written |= {alias.asname or alias.name for alias in node.names}
    for node in ast.walk(tree):
        match node:
            case ast.Name(name) | ast.Attribute(attr=name) if name in ROUND_THE_RULE:
                yield f"it uses {name}"
            case ast.Attribute(ast.Call(ast.Name("super")), name, ast.Load()) if name in set().union(*methods.values()):
                yield f"it uses the package's own {name} by super()"
            case ast.Attribute(ast.Attribute(attr=cls), name, ast.Load()) if name in methods.get(cls, ()):
                yield f"it uses the package's own {cls}.{name}"
            case ast.Attribute(ast.Name(cls), name, ast.Load()) if cls not in written and name in methods.get(cls, ()):
                yield f"it uses the package's own {cls}.{name}"
