"""Makes what a student gets from a tagged solution.

The tags are those of nbgrader and otter-grader. What stands between

    ### BEGIN SOLUTION        and        ### END SOLUTION

is replaced by ``# YOUR CODE HERE`` and a call of ``not_written``, which the student deletes. The number of # does not
matter. After ``# BEGIN SOLUTION NO PROMPT``, nothing takes its place. A text between ``\"\"\" # BEGIN PROMPT`` and
``\"\"\" # END PROMPT`` that follows a solution takes the place of ``# YOUR CODE HERE``.
"""

import ast
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from taichi_tracer.system.errors import InputError

BEGIN = re.compile(r"^(\s*)#+\s*BEGIN SOLUTION(\s+NO PROMPT)?\s*$")
END = re.compile(r"^\s*#+\s*END SOLUTION\s*$")
BEGIN_PROMPT = re.compile(r'^\s*"""\s*#+\s*BEGIN PROMPT\s*$')
END_PROMPT = re.compile(r'^\s*"""\s*;?\s*#+\s*END PROMPT\s*$')

PLACE, CALL = "# YOUR CODE HERE", "tt.teaching.not_written("
REMINDER = "# delete this line when the method is written"


class Solution(NamedTuple):
    """What stands between two tags, and what takes its place: for students, and for otter-grader."""

    lines: list[str]
    stub: list[str]
    otter: list[str]


def stub_of(source: str, name: str) -> str:
    """The student's version of a tagged file.

    Args:
        name: the name of the file, for messages.

    Raises:
        InputError: a tag has no partner; the message has the line.
    """
    text = written(source, name, lambda solution: solution.stub)
    return with_package(text) if CALL in text else text


def solved(source: str, name: str) -> str:
    """The tagged file without its tags and prompts."""
    return written(source, name, lambda solution: solution.lines)


def for_otter(source: str, name: str) -> str:
    """The tagged file with the tags of otter-grader: what replaces a solution stands behind it, as a text."""
    return with_package(written(source, name, lambda solution: solution.otter))


def written(source: str, name: str, choice: Callable[[Solution], list[str]]) -> str:
    """The file with one form of each solution in it."""
    lines = []
    for piece in pieces(source, name):
        lines += [piece] if isinstance(piece, str) else choice(piece)
    return "\n".join(lines) + "\n"


def pieces(source: str, name: str) -> Iterator[str | Solution]:
    """The lines and the solutions of a tagged file."""
    lines, owners = source.splitlines(), methods_by_line(source, name)
    i = 0
    while i < len(lines):
        begin = BEGIN.match(lines[i])
        if begin is None:
            if END.match(lines[i]):
                raise InputError(f"{name}:{i + 1}: END SOLUTION without a BEGIN SOLUTION before it")
            yield lines[i]
            i += 1
            continue
        end = partner(lines, i, END, f"{name}:{i + 1}: BEGIN SOLUTION without an END SOLUTION after it")
        prompt, after = prompt_after(lines, end + 1, name)
        solution, indent, method = lines[i + 1 : end], begin.group(1), owners.get(i + 1, "")
        stub = (prompt or [f"{indent}{PLACE}"]) + [f'{indent}{CALL}"{method}")  {REMINDER}'] * bool(method)
        otter = [f"{indent}# BEGIN SOLUTION NO PROMPT", *solution, f"{indent}# END SOLUTION"]
        if begin.group(2) is None:
            otter += [f'{indent}""" # BEGIN PROMPT', *stub, f'{indent}""" # END PROMPT']
        yield Solution(solution, stub if begin.group(2) is None else [], otter)
        i = after


def with_package(text: str) -> str:
    """A file that knows ``tt``: the import is added after its other imports, unless it is there."""
    tree = ast.parse(text)
    imports = [node for node in tree.body if isinstance(node, (ast.Import, ast.ImportFrom))]
    if "tt" in {alias.asname for node in imports for alias in node.names}:
        return text
    docstring = tree.body[:1] if ast.get_docstring(tree) is not None else []
    before = imports[-1:] or docstring
    lines = text.splitlines(keepends=True)
    at = (before[0].end_lineno or 0) if before else 0
    gap = "" if imports else "\n"
    return "".join([*lines[:at], gap * bool(before), "import taichi_tracer as tt\n", *lines[at:]])


def partner(lines: list[str], first: int, pattern: re.Pattern, message: str) -> int:
    """The next line after ``first`` that has a tag, before another solution begins; an InputError without one."""
    for i in range(first + 1, len(lines)):
        if pattern.match(lines[i]):
            return i
        if BEGIN.match(lines[i]):
            break
    raise InputError(message)


def prompt_after(lines: list[str], first: int, name: str) -> tuple[list[str], int]:
    """(the lines of a prompt that begins at ``first``, the line after it); without a prompt, ([], first)."""
    if first >= len(lines) or not BEGIN_PROMPT.match(lines[first]):
        return [], first
    end = partner(lines, first, END_PROMPT, f"{name}:{first + 1}: BEGIN PROMPT without an END PROMPT after it")
    return lines[first + 1 : end], end + 1


def methods_by_line(source: str, name: str) -> dict[int, str]:
    """Line → "Class.method", for all lines of all methods; a function of the file has its own name."""
    try:
        tree = ast.parse(source)
    except SyntaxError as error:
        raise InputError(f"{name}:{error.lineno}: {error.msg}") from None
    found: dict[int, str] = {}
    for node in tree.body:
        members = node.body if isinstance(node, ast.ClassDef) else [node]
        for member in members:
            if isinstance(member, ast.FunctionDef):
                owner = f"{node.name}." if isinstance(node, ast.ClassDef) else ""
                found |= dict.fromkeys(range(member.lineno, (member.end_lineno or 0) + 1), owner + member.name)
    return found
