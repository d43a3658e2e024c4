"""Makes what a student gets from a tagged solution.

The tags are those of nbgrader and otter-grader. What stands between

    ### BEGIN SOLUTION        and        ### END SOLUTION

is replaced by ``# YOUR CODE HERE`` and a call of ``not_written``, which the student deletes. The number of # does not
matter. After ``# BEGIN SOLUTION NO PROMPT``, nothing takes its place. A text between ``\"\"\" # BEGIN PROMPT`` and
``\"\"\" # END PROMPT`` that follows a solution takes the place of ``# YOUR CODE HERE``.
"""

import ast
import re

from taichi_tracer.system.errors import InputError

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


def written(source: str, name: str, form: str) -> str:
    """A tagged file with each solution in one form.

    Args:
        name: the name of the file, for messages.
        form: "stub" for the student's version; "solved" for the solution without its tags and prompts; "otter" for the
            tags of otter-grader, where what replaces a solution stands behind it, as a text.

    Raises:
        InputError: a tag has no partner; the message has the line.
    """
    source, owners = source.rstrip("\n") + "\n", methods_by_line(source, name)
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
        stub = found["prompt"] or f"{indent}{PLACE}\n"
        stub += f'{indent}{CALL}"{method}")  {REMINDER}\n' if method else ""
        prompt = "" if found["bare"] else f'{indent}""" # BEGIN PROMPT\n{stub}{indent}""" # END PROMPT\n'
        otter = f"{indent}# BEGIN SOLUTION NO PROMPT\n{found['lines']}{indent}# END SOLUTION\n{prompt}"
        return {"solved": found["lines"], "stub": "" if found["bare"] else stub, "otter": otter}[form]

    return SOLUTION.sub(replaced, source)


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
