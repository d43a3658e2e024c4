"""Submissions whose texts have the same structure, under whatever names: a list for a human eye, and no verdict.

Each function becomes a row of words, one for each node of its syntax tree, without names, comments and layout. Runs of
``RUN`` words that follow each other are compared; see Schleimer, Wilkerson, Aiken: Winnowing, Local Algorithms for
Document Fingerprinting, SIGMOD 2003. Runs of the text that was handed out do not count. The handout leads many students
to the same lines, so a run counts by ln(n/m), if m of n submissions have it: what all have says nothing.
"""

import ast
import contextlib
import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from taichi_tracer.teaching import submissions, temporary
from taichi_tracer.teaching.base import Assignment
from taichi_tracer.teaching.cutting import solved, stub_of
from taichi_tracer.teaching.submissions import RefusedError, Submission

RUN = 12  # words: about a line of code
ALIKE = 0.5  # the share of the rarer runs of the smaller submission that a pair has in common, if it is listed
LEAST = 25.0  # what these runs count together: a few lines may be alike by chance
SOLUTION = "the solution"
MOST_FUNCTIONS, MOST_KEYS = 3, 8  # that a line names


@dataclass(frozen=True)
class Group:
    """Submissions that are alike: each with another one of the group.

    Attributes:
        keys: of the submissions; the solution may be among them.
        share: of what the smaller one of a pair has and few others have, what both have: of the least alike pair.
        functions: where most of it is.
    """

    keys: tuple[str, ...]
    share: float
    functions: tuple[str, ...]

    def __str__(self) -> str:
        shown, rest = self.keys[:MOST_KEYS], len(self.keys) - MOST_KEYS
        keys = ", ".join(shown) + (f" and {rest} more" if rest > 0 else "")
        return f"{keys}: {self.share:.0%} of what few others have, in {', '.join(self.functions)}"

    def facts(self) -> dict:
        """The group for JSON."""
        return {"submissions": self.keys, "share": round(self.share, 3), "functions": self.functions}


def groups(assignment: Assignment, found: Sequence[Submission]) -> list[Group]:
    """The submissions that a human should look at together, the most alike first."""
    work = temporary.folder("similar")
    runs = {SOLUTION: runs_of({file: solved(text, file) for file, text in solution_texts(assignment).items()})}
    try:
        for number, submitted in enumerate(found):
            with contextlib.suppress(RefusedError):
                folder = submissions.unpack(submitted, work / str(number), assignment.files).folder
                runs[submitted.key] = runs_of({file: text_of(folder / file) for file in assignment.files})
    finally:
        temporary.remove(work)
    given = runs_of({file: stub_of(text, file) for file, text in solution_texts(assignment).items()})
    return groups_of(pairs_of(runs, given))


def solution_texts(assignment: Assignment) -> dict[str, str]:
    """File → the tagged text of the solution."""
    return {file: (assignment.solution_folder / file).read_text(encoding="utf-8") for file in assignment.files}


def text_of(path: Path) -> str:
    """The text of a file; "" if there is none, or if it is not one."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError):
        return ""


def groups_of(pairs: Sequence[Group]) -> list[Group]:
    """The pairs that have a submission in common, joined."""
    joined: list[Group] = []
    for pair in pairs:
        near = [group for group in joined if set(group.keys) & set(pair.keys)]
        keys = tuple(sorted({*pair.keys, *(key for group in near for key in group.keys)}))
        share, functions = min((pair, *near), key=lambda group: group.share).share, (near or [pair])[0].functions
        joined = [group for group in joined if group not in near] + [Group(keys, share, functions)]
    return sorted(joined, key=lambda group: (-group.share, group.keys))


def pairs_of(runs: Mapping[str, Mapping[str, Counter]], given: Mapping[str, Counter]) -> list[Group]:
    """The pairs of submissions that are alike, the most alike first.

    Args:
        runs: key of a submission → function → its runs. given: function → the runs that were handed out.
    """
    known = {run for counts in given.values() for run in counts}
    own = {key: {run for counts in of_function.values() for run in counts} - known for key, of_function in runs.items()}
    have = Counter(run for each in own.values() for run in each)
    weights = {run: math.log(len(own) / count) for run, count in have.items()}
    sizes = {key: sum(weights[run] for run in each) for key, each in own.items()}
    listed = []
    for first, second in itertools.combinations(own, 2):
        smaller = min(sizes[first], sizes[second])
        both = own[first] & own[second]
        common = sum(weights[run] for run in both)
        if common >= max(LEAST, ALIKE * smaller):
            where = Counter(
                {name: sum(weights[run] for run in both & counts.keys()) for name, counts in runs[first].items()}
            )
            functions = tuple(name for name, weight in where.most_common(MOST_FUNCTIONS) if weight > 0)
            listed.append(Group((first, second), common / smaller, functions))
    return sorted(listed, key=lambda pair: (-pair.share, pair.keys))


def runs_of(texts: Mapping[str, str]) -> dict[str, Counter]:
    """Function, as "Class.method", → its runs of words, and how often each occurs."""
    found: dict[str, Counter] = {}
    for text in texts.values():
        try:
            tree = ast.parse(text)
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            continue
        for top in tree.body:
            owner = f"{top.name}." if isinstance(top, ast.ClassDef) else ""
            for node in top.body if isinstance(top, ast.ClassDef) else [top]:
                if isinstance(node, ast.FunctionDef):
                    words = words_of(node)
                    runs = zip(*(words[i:] for i in range(RUN)), strict=False)
                    found[owner + node.name] = Counter(hash(run) for run in runs)
    return found


def words_of(function: ast.FunctionDef) -> list[str]:
    """One word for each node of a function's body, in the order of the text; its docstring does not count."""
    words: list[str] = []
    waiting: list[ast.AST] = list(reversed(function.body[ast.get_docstring(function) is not None :]))
    while waiting:
        node = waiting.pop()
        if not isinstance(node, ast.expr_context):
            is_number = isinstance(node, ast.Constant) and isinstance(node.value, (int, float))
            words.append(repr(node.value) if is_number else type(node).__name__)
            waiting += reversed(list(ast.iter_child_nodes(node)))
    return words
