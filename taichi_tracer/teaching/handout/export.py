"""Writes a student's folder, or notebook, of an assignment; with ``is_solved``, the solution in the same form.

The tags are those of nbgrader and otter-grader. What stands between

    ### BEGIN SOLUTION        and        ### END SOLUTION

is replaced by ``# YOUR CODE HERE`` and a call of ``not_written``, which the student deletes. The number of # does not
matter. After ``# BEGIN SOLUTION NO PROMPT``, nothing takes its place. A text between ``\"\"\" # BEGIN PROMPT`` and
``\"\"\" # END PROMPT`` that follows a solution takes the place of ``# YOUR CODE HERE``.
"""

import ast
import json
import re
import shutil
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import replace_file
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Assignment, Mistake, joined
from taichi_tracer.teaching.catalogue import ANSWERS, SHIPPED

RECORD = "assignment.json"  # which assignment a folder belongs to, for ``taichi-tracer check``
CHECKS = "checks"  # the folder with the answers of a solution that is not handed out

CHECK = '''"""Checks this folder: python check.py, or python check.py NAME_OF_A_PART. It needs no network."""

import sys
from pathlib import Path

from taichi_tracer.apps.cli import main

if __name__ == "__main__":
    raise SystemExit(main(["check", str(Path(__file__).parent), *sys.argv[1:]]))
'''

WORKING = """
## How to work on it

Each method to write has its task in the text below its first line, and a line `tt.teaching.not_written(...)`. Write the
method, then delete this line. Until then, the picture is dark, and the terminal names the methods that are missing.

| command | what it does |
|---|---|
| `python check.py` | checks each method by itself; a wrong number stands beside the right one; writes `check.html` |
| `python check.py NAME` | the same for one method, such as `{example}`; it takes a few seconds |
{program}
Each method is checked together with the right versions of the others. So you can write them in any order.

Hand in {files}.
"""


def write_folder(assignment: Assignment, folder: str | Path, is_solved: bool = False, seed: int = 0) -> list[Path]:
    """Write the files of an assignment into a folder that does not exist yet, or is empty. Returns their paths.

    Raises:
        InputError: the folder has files already, so that nothing is written over a student's work.
    """
    texts = sources(assignment, "solved" if is_solved else "stub")
    texts |= {"README.md": readme(assignment), "check.py": CHECK}
    texts |= {RECORD: json.dumps(record(assignment, seed), indent=1) + "\n"}
    return write_all(assignment, Path(folder).expanduser(), texts, seed)


def write_notebook(
    assignment: Assignment, folder: str | Path, is_solved: bool = False, seed: int = 0, grader: str = ""
) -> list[Path]:
    """Write an assignment as one notebook, into a folder that does not exist yet, or is empty. Returns its path.

    Args:
        grader: "nbgrader" or "otter" for a teacher's notebook of this program, which has the tagged solution.
    """
    word = record(assignment, seed)["assignment"]
    text = (assignment.folder / "README.md").read_text(encoding="utf-8")
    texts = sources(assignment, grader or ("solved" if is_solved else "stub"))
    try:
        from taichi_tracer.teaching.handout.notebooks import notebook
    except ImportError:
        raise InputError("a notebook needs nbformat: pip install 'taichi_tracer[notebook]'") from None
    content = notebook(assignment, word, texts, text, seed, grader)
    return write_all(assignment, Path(folder).expanduser(), {f"{assignment.name}.ipynb": content}, seed)


def write_all(assignment: Assignment, folder: Path, texts: dict[str, str], seed: int) -> list[Path]:
    """Write texts, the pictures of the assignment, and the checks of an assignment that is not in the package."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: there is something already, and nothing is written over it: give a new folder")
    folder.mkdir(parents=True, exist_ok=True)
    if not is_shipped(assignment):
        seal(assignment, folder / CHECKS, seed)
    for name, text in texts.items():
        replace_file(folder / name, text.encode())
    for ending in ("*.png", "*.svg", "*.jpg"):  # that the text shows
        for picture in assignment.folder.glob(ending):
            shutil.copyfile(picture, folder / picture.name)
    return sorted(path for path in folder.rglob("*") if path.is_file())


def seal(assignment: Assignment, folder: Path, seed: int) -> None:
    """Write an assignment with the answers in place of its solution into a new folder; see ``catalogue``.

    Raises:
        InputError: the solution does not run.
    """
    from taichi_tracer.teaching import checking, running  # which need this module

    runtime.ensure()
    found = {f"part {i}": running.expected(assignment, part, seed) for i, part in enumerate(assignment.parts)}
    for i, mistake in enumerate(assignment.mistakes):
        found[f"mistake {i}"] = checking.answers_of(assignment, assignment.part(mistake.part), mistake, seed) or {}
    facts = {
        "name": assignment.name,
        "seed": seed,
        "classes": dict(assignment.classes),
        "program": assignment.program,
        "mistakes": [[m.part, m.name, m.hint] for m in assignment.mistakes],
    }
    folder.mkdir()
    for path in (assignment.folder / "README.md", *assignment.folder.glob("*.py")):
        if path.name != "mistakes.py":
            shutil.copyfile(path, folder / path.name)
    np.savez(folder / ANSWERS, facts=np.array(json.dumps(facts)), **joined(found))  # type: ignore[arg-type]


def sources(assignment: Assignment, form: str) -> dict[str, str]:
    """Name → text of every Python file: the "stub", "solved", or the tagged solution for "nbgrader" or "otter".

    The tags of an assignment are those of nbgrader.
    """
    texts = {path: path.read_text(encoding="utf-8") for path in sorted((assignment.folder / "solution").glob("*.py"))}
    return {p.name: text if form == "nbgrader" else written(text, str(p), form) for p, text in texts.items()}


def record(assignment: Assignment, seed: int) -> dict:
    """What ``check`` needs to know about a folder."""
    return {"assignment": assignment.name if is_shipped(assignment) else CHECKS, "seed": seed}


def is_shipped(assignment: Assignment) -> bool:
    """Whether an assignment comes with the package, so that everybody who has the package can load it by its name."""
    return assignment.folder.parent == SHIPPED


def readme(assignment: Assignment) -> str:
    """The text of the assignment, and how to work on it."""
    text = (assignment.folder / "README.md").read_text(encoding="utf-8").rstrip() + "\n"
    program = f"| `python {assignment.program}` | opens a window with your own code |\n" if assignment.program else ""
    files = " and ".join(f"`{name}`" for name in assignment.files)
    return text + WORKING.format(example=assignment.parts[0].name, program=program, files=files)


# ── tagged solutions ──

TAG = re.compile(r'^\s*(?:"""\s*;?\s*)?#+\s*(BEGIN|END) (SOLUTION|PROMPT)\b')
SOLUTION = re.compile(
    r"""
    ^(?P<indent>[ ]*)\#+[ ]*BEGIN[ ]SOLUTION(?P<bare>[ ]+NO[ ]PROMPT)?[ ]*\n
    (?P<lines>(?:(?![ ]*\#+[ ]*BEGIN[ ]SOLUTION).*\n)*?)
    [ ]*\#+[ ]*END[ ]SOLUTION[ ]*\n
    (?:[ ]*\"{3}[ ]*\#+[ ]*BEGIN[ ]PROMPT[ ]*\n (?P<prompt>(?:.*\n)*?) [ ]*\"{3}[ ]*;?[ ]*\#+[ ]*END[ ]PROMPT[ ]*\n)?
    """,
    re.MULTILINE | re.VERBOSE,
)

PLACE, CALL, IMPORT = "# YOUR CODE HERE", "tt.teaching.not_written(", "import taichi_tracer as tt"
REMINDER = "# delete this line when the method is written"


def written(source: str, name: str, form: str, mistake: Mistake | None = None) -> str:
    """A tagged file with each solution in one form.

    Args:
        name: the name of the file, for messages.
        form: "stub" for the student's version; "solved" for the solution without its tags and prompts; "otter" for the
            tags of otter-grader, where what replaces a solution stands behind it, as a text.
        mistake: is made in the solution.

    Raises:
        InputError: a tag has no partner; the message has the line.
    """
    source, owners = source.rstrip("\n") + "\n", methods_by_line(source)
    rest = SOLUTION.sub(lambda found: "\n" * found[0].count("\n"), source)  # whose lines have the same numbers
    for number, line in enumerate(rest.splitlines(), start=1):
        if tag := TAG.match(line):
            other = "an END {} after it" if tag[1] == "BEGIN" else "a BEGIN {} before it"
            raise InputError(f"{name}:{number}: {tag[1]} {tag[2]} without {other.format(tag[2])}")

    if SOLUTION.search(source) and form != "solved" and IMPORT not in source:
        raise InputError(f"{name}: add '{IMPORT}': students' files call tt.teaching.not_written")

    def replaced(found: re.Match) -> str:
        """One form of what stands between two tags."""
        indent, method = found["indent"], owners.get(source.count("\n", 0, found.start()) + 1, "")
        lines = mistake.applied(found["lines"]) if mistake is not None and mistake.part == method else found["lines"]
        stub = found["prompt"] or f"{indent}{PLACE}\n"
        stub += f'{indent}{CALL}"{method}")  {REMINDER}\n' if method else ""
        prompt = "" if found["bare"] else f'{indent}""" # BEGIN PROMPT\n{stub}{indent}""" # END PROMPT\n'
        otter = f"{indent}# BEGIN SOLUTION NO PROMPT\n{lines}{indent}# END SOLUTION\n{prompt}"
        return {"solved": lines, "stub": "" if found["bare"] else stub, "otter": otter}[form]

    return SOLUTION.sub(replaced, source)


def methods_by_line(source: str) -> dict[int, str]:
    """Line → "Class.method", for all lines of all methods; a function of the file has its own name."""
    found: dict[int, str] = {}
    for node in ast.parse(source).body:
        members = node.body if isinstance(node, ast.ClassDef) else [node]
        for member in members:
            if isinstance(member, ast.FunctionDef):
                owner = f"{node.name}." if isinstance(node, ast.ClassDef) else ""
                found |= dict.fromkeys(range(member.lineno, (member.end_lineno or 0) + 1), owner + member.name)
    return found
