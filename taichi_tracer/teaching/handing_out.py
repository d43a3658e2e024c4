"""Writes a student's folder, or notebook, of an assignment; with ``is_solved``, the solution in the same form."""

import json
import shutil
from pathlib import Path

from taichi_tracer.files.disk import replace_file
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Assignment
from taichi_tracer.teaching.catalogue import SHIPPED
from taichi_tracer.teaching.cutting import for_otter, solved, stub_of
from taichi_tracer.teaching.notebooks import notebook
from taichi_tracer.teaching.sealed import seal

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
method, then delete this line. Until then, the window shows a checkerboard with the names of the methods that are
missing.

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
    folder = Path(folder).expanduser()
    texts = sources(assignment, is_solved)
    texts["README.md"] = readme(assignment)
    texts["check.py"] = CHECK
    texts[RECORD] = json.dumps(record(assignment, seed), indent=1) + "\n"
    return write_all(assignment, folder, texts, seed)


def write_notebook(
    assignment: Assignment, folder: str | Path, is_solved: bool = False, seed: int = 0, grader: str = ""
) -> list[Path]:
    """Write an assignment as one notebook, into a folder that does not exist yet, or is empty. Returns its path.

    Args:
        grader: "nbgrader" or "otter" for a teacher's notebook of this program, which has the tagged solution.
    """
    folder = Path(folder).expanduser()
    word = record(assignment, seed)["assignment"]
    text = (assignment.folder / "README.md").read_text(encoding="utf-8")
    texts = tagged(assignment, grader) if grader else sources(assignment, is_solved)
    made = notebook(assignment, word, texts, text, seed, grader)
    content = json.dumps(made, indent=1, ensure_ascii=False) + "\n"
    return write_all(assignment, folder, {f"{assignment.name}.ipynb": content}, seed)


def write_all(assignment: Assignment, folder: Path, texts: dict[str, str], seed: int) -> list[Path]:
    """Write texts, the pictures of the assignment, and the checks of an assignment that is not in the package."""
    make_empty(folder)
    written = []
    if not is_shipped(assignment):
        seal(assignment, folder / CHECKS, seed)
        written += sorted((folder / CHECKS).iterdir())
    for name, text in texts.items():
        replace_file(folder / name, text.encode())
        written.append(folder / name)
    for picture in pictures(assignment):
        shutil.copyfile(picture, folder / picture.name)
        written.append(folder / picture.name)
    return written


def make_empty(folder: Path) -> None:
    """Make a folder; an InputError if there is something in it."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: there is something already, and nothing is written over it: give a new folder")
    folder.mkdir(parents=True, exist_ok=True)


def sources(assignment: Assignment, is_solved: bool) -> dict[str, str]:
    """Name → text of every Python file of the solution, cut or solved."""
    change = solved if is_solved else stub_of
    files = sorted(assignment.solution_folder.glob("*.py"))
    return {path.name: change(path.read_text(encoding="utf-8"), str(path)) for path in files}


def tagged(assignment: Assignment, grader: str) -> dict[str, str]:
    """Name → text of every Python file of the solution, with the tags of this program."""
    paths = sorted(assignment.solution_folder.glob("*.py"))
    texts = {path.name: path.read_text(encoding="utf-8") for path in paths}
    return {name: for_otter(text, name) for name, text in texts.items()} if grader == "otter" else texts


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


def pictures(assignment: Assignment) -> list[Path]:
    """The pictures that the text shows."""
    return sorted(path for ending in ("*.png", "*.svg", "*.jpg") for path in assignment.folder.glob(ending))
