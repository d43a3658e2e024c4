"""Makes what a student gets from a tagged solution.

The tags are those of nbgrader and otter-grader. What stands between

    ### BEGIN SOLUTION        and        ### END SOLUTION

is replaced by ``# YOUR CODE HERE`` and a call of ``not_written``, which the student deletes. The number of # does not
matter. After ``# BEGIN SOLUTION NO PROMPT``, nothing takes its place. A text between ``\"\"\" # BEGIN PROMPT`` and
``\"\"\" # END PROMPT`` that follows a solution takes the place of ``# YOUR CODE HERE``.
"""

import ast
import re
from collections.abc import Callable, Collection

from taichi_tracer.system.errors import InputError

BEGIN = re.compile(r"^(\s*)#+\s*BEGIN SOLUTION(\s+NO PROMPT)?\s*$")
END = re.compile(r"^\s*#+\s*END SOLUTION\s*$")
BEGIN_PROMPT = re.compile(r'^\s*"""\s*#+\s*BEGIN PROMPT\s*$')
END_PROMPT = re.compile(r'^\s*"""\s*;?\s*#+\s*END PROMPT\s*$')

PLACE, CALL = "# YOUR CODE HERE", "tt.teaching.not_written("
REMINDER = "# delete this line when the method is written"


def stub_of(source: str, name: str) -> str:
    """The student's version of a tagged file.

    Args:
        name: the name of the file, for messages.

    Raises:
        InputError: a tag has no partner; the message has the line.
    """
    return partly_solved(source, name, ())


def partly_solved(source: str, name: str, shown: Collection[str]) -> str:
    """A tagged file with the solution of some methods alone: "Class.method", or "" for what is in no method."""
    text = "\n".join(_lines(source, name, lambda owner: owner in shown)) + "\n"
    return with_package(text) if CALL in text else text


def for_otter(source: str, name: str) -> str:
    """The tagged file with the tags of otter-grader: what replaces a solution stands behind it, as a text."""
    lines, owners, kept = source.splitlines(), methods_by_line(source, name), []
    i = 0
    while i < len(lines):
        begin = BEGIN.match(lines[i])
        if begin is None:
            kept.append(lines[i])
            i += 1
            continue
        end = partner(lines, i, END, f"{name}:{i + 1}: BEGIN SOLUTION without an END SOLUTION after it")
        prompt, after = prompt_after(lines, end + 1, name)
        indent, method = begin.group(1), owners.get(i + 1, "")
        kept += [f"{indent}# BEGIN SOLUTION NO PROMPT", *lines[i + 1 : end], f"{indent}# END SOLUTION"]
        if begin.group(2) is None:
            prompt = (prompt or [f"{indent}{PLACE}"]) + [f'{indent}{CALL}"{method}")  {REMINDER}'] * bool(method)
            kept += [f'{indent}""" # BEGIN PROMPT', *prompt, f'{indent}""" # END PROMPT']
        i = after
    return with_package("\n".join(kept) + "\n")


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


def solved(source: str, name: str) -> str:
    """The tagged file without its tags and prompts."""
    return "\n".join(_lines(source, name, lambda _owner: True)) + "\n"


def _lines(source: str, name: str, is_shown: Callable[[str], bool]) -> list[str]:
    lines = source.splitlines()
    owners = methods_by_line(source, name)
    kept: list[str] = []
    i = 0
    while i < len(lines):
        begin = BEGIN.match(lines[i])
        if begin is None:
            if END.match(lines[i]):
                raise InputError(f"{name}:{i + 1}: END SOLUTION without a BEGIN SOLUTION before it")
            kept.append(lines[i])
            i += 1
            continue
        end = partner(lines, i, END, f"{name}:{i + 1}: BEGIN SOLUTION without an END SOLUTION after it")
        prompt, after = prompt_after(lines, end + 1, name)
        method = owners.get(i + 1, "")
        if is_shown(method):
            kept += lines[i + 1 : end]
        elif begin.group(2) is None:
            indent = begin.group(1)
            kept += prompt or [f"{indent}{PLACE}"]
            if method:
                kept.append(f'{indent}{CALL}"{method}")  {REMINDER}')
        i = after
    return kept


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
    found = {}
    for node in tree.body:
        members = node.body if isinstance(node, ast.ClassDef) else [node]
        for member in members:
            if isinstance(member, ast.FunctionDef):
                owner = f"{node.name}." if isinstance(node, ast.ClassDef) else ""
                found |= dict.fromkeys(range(member.lineno, (member.end_lineno or 0) + 1), owner + member.name)
    return found
