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
OF_PYTHON = ("__subclasses__", "__globals__", "__closure__", "__code__", "__dict__", "__mro__", "_getframe", "__spec__")
OPENS = ("open", "fdopen", "read_text", "read_bytes", "write_text", "write_bytes")
READS_ARRAYS = ("load", "fromfile", "loadtxt", "genfromtxt", "memmap", "imread")  # of a module
CHANGES = ("setattr", "delattr")
LONGEST = 60  # characters of a call that a report shows


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
    nodes, others = list(ast.walk(tree)), set()
    written = {node.name for node in nodes if isinstance(node, ast.ClassDef)}
    for node in (node for node in nodes if isinstance(node, (ast.Import, ast.ImportFrom))):
        is_own = isinstance(node, ast.ImportFrom) and (node.module or "").removeprefix("taichi_tracer.") in own
        names = {alias.asname or alias.name.partition(".")[0] for alias in node.names}
        (written if is_own else others).update(names)  # as files of the course import each other
    for node in nodes:
        match node:
            case ast.Name(name) if name in ROUND_THE_RULE:
                yield f"it uses {name}"
            case ast.Attribute(attr=name) if name in OF_PYTHON:
                yield f"it uses {name}"
            case ast.Attribute(ast.Call(ast.Name("super")), name, ast.Load()) if name in set().union(*methods.values()):
                yield f"it uses the package's own {name} by super()"
            case ast.Attribute(ast.Attribute(attr=cls), name, ast.Load()) if name in methods.get(cls, ()):
                yield f"it uses the package's own {cls}.{name}"
            case ast.Attribute(ast.Name(cls), name, ast.Load()) if cls not in written and name in methods.get(cls, ()):
                yield f"it uses the package's own {cls}.{name}"
            case ast.Attribute(ctx=ast.Store() | ast.Del()) | ast.Subscript(ctx=ast.Store() | ast.Del()):
                yield from [f"it changes {ast.unparse(node)}"] * (root_of(node) in others)
            case ast.Call(ast.Attribute(attr=name) | ast.Name(name), arguments):
                is_of_module = isinstance(node.func, ast.Attribute) and root_of(node.func) in others
                if name in OPENS or (name in READS_ARRAYS and is_of_module):
                    yield f"it opens a file: {ast.unparse(node)[:LONGEST]}"
                if name in CHANGES and arguments and root_of(arguments[0]) in others:
                    yield f"it changes {ast.unparse(arguments[0])}"


def root_of(node: ast.AST) -> str:
    """The name that an expression such as a.b[i].c begins with; "" if it begins with none."""
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""
