"""Cells that nbgrader and otter-grader know: what a student writes, and what earns points.

A teacher's notebook has the solution between its tags. Both programs make the students' version of it, without the
solution, and give points for the cells behind it. nbgrader takes a number that a cell returns as its points, an error
as none; a test of otter-grader is passed, or not. Checks with another seed are hidden from students.
"""

from collections.abc import Callable, Sequence

from taichi_tracer.teaching.base import Part

Cell = dict
NBGRADER = {"grade": False, "locked": False, "schema_version": 3, "solution": False, "task": False}


def markdown(name: str, text: str) -> Cell:
    """A cell of text."""
    return {"cell_type": "markdown", "id": name, "metadata": {}, "source": text.splitlines(keepends=True)}


def raw(name: str, text: str) -> Cell:
    """A cell with words for otter-grader."""
    return {"cell_type": "raw", "id": name, "metadata": {}, "source": text.splitlines(keepends=True)}


def code(name: str, source: str, is_written_by_student: bool = False, points: float | None = None) -> Cell:
    """A cell of code.

    Args:
        points: that the cell earns; None if it is not graded.
    """
    facts = {**NBGRADER, "grade_id": name, "solution": is_written_by_student}
    facts |= {} if points is None else {"grade": True, "locked": True, "points": points}
    return {
        "cell_type": "code",
        "execution_count": None,
        "id": name,
        "metadata": {"nbgrader": facts} if is_written_by_student or points is not None else {},
        "outputs": [],
        "source": source.rstrip().splitlines(keepends=True),
    }


def head(grader: str, name: str) -> list[Cell]:
    """What stands at the top of a notebook."""
    return [raw("assignment", f"# ASSIGNMENT CONFIG\nname: {name}\ninit_cell: false")] if grader == "otter" else []


def question(
    grader: str,
    written: Cell | None,
    name: str,
    parts: Sequence[Part],
    shown: Callable[[Part], str],
    hidden: Callable[[Part], str],
) -> list[Cell]:
    """A file of the solution, and the cells that earn the points of its parts.

    Args:
        written: the cell of the file; None for pictures, for which all files have been written.
        shown, hidden: part → the call that checks it, for students and for grading.
    """
    solution = [] if written is None else [written]
    if grader == "nbgrader" or not parts:
        return solution + [for_nbgrader(part, shown(part), hidden(part)) for part in parts]
    words = f"# BEGIN QUESTION\nname: {name}\npoints: {sum(part.points for part in parts):g}"
    if solution:
        solution = [raw(f"{name}-solution", "# BEGIN SOLUTION"), *solution, raw(f"{name}-end", "# END SOLUTION")]
    tests = [
        one for part in parts for one in (for_otter(part, shown(part), False), for_otter(part, hidden(part), True))
    ]
    tests = [raw(f"{name}-tests", "# BEGIN TESTS"), *tests, raw(f"{name}-tests-end", "# END TESTS")]
    return [raw(f"{name}-question", words), *solution, *tests, raw(f"{name}-question-end", "# END QUESTION")]


def for_nbgrader(part: Part, shown: str, hidden: str) -> Cell:
    """The cell that earns the points of a part."""
    lines = [f"report = {shown}", "### BEGIN HIDDEN TESTS", f"report = {hidden}", "### END HIDDEN TESTS"]
    return code(identifier(part), "\n".join([*lines, "display(report)", "report.score()"]), points=part.points)


def for_otter(part: Part, call: str, is_hidden: bool) -> Cell:
    """A test of a part. The hidden one has its points."""
    config = f"hidden: {str(is_hidden).lower()}\npoints: {part.points if is_hidden else 0:g}"
    text = f'''""" # BEGIN TEST CONFIG\n{config}\n""" # END TEST CONFIG\nassert {call}.is_right'''
    return code(f"{identifier(part)}-{'hidden' if is_hidden else 'shown'}", text)


def identifier(part: Part) -> str:
    """The name of a part as the name of a cell: letters, digits and dashes."""
    return "".join(c if c.isalnum() else "-" for c in part.name).replace("--", "-")
