"""Says what is wrong with an answer: which known mistake, or which two, would give the same numbers.

A known mistake is a small change of the solution's text, see ``base.Mistake``. The changed solution is run on the
inputs of the part. If it gives the student's answer on every input, the mistake is named. Several mistakes may give the
same numbers on these inputs; then all of them are named. If neither one mistake nor a pair of them fits, the error is
described as far as numbers show it, see ``descriptions``.
"""

import ast
import contextlib
import hashlib
import itertools
import math
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

import taichi_tracer
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import sealed, sketches
from taichi_tracer.teaching.base import Arrays, Assignment, Mistake, Part
from taichi_tracer.teaching.cutting import solved
from taichi_tracer.teaching.descriptions import describe
from taichi_tracer.teaching.judges import agree
from taichi_tracer.teaching.kept import arrays_in, cache_folder, keep_arrays
from taichi_tracer.teaching.loading import OK, Loaded, load_classes, solution_of
from taichi_tracer.teaching.running import answer, expected

MOST_PAIRS = (
    16  # how many pairs of mistakes are tried for one answer; of pairs that were made, at least 7 of 10 are found
)
NOTHING = "nothing"  # the only array of a file that says that a mistake has no answers
SAME_LIKELIHOOD = 0.02  # pairs that are less likely than a pair that fits, by more than this, are not tried


@dataclass(frozen=True)
class Finding:
    """What is probably wrong with an answer.

    Attributes:
        names: the names of the mistakes: one; two that were made together; or none, if the error is only described.
        share: the share of the inputs whose answer it explains.
        text: a sentence for the report.
        hint: a sentence that leads to the solution. topic: the topic of the lecture.
    """

    names: tuple[str, ...]
    share: float
    text: str
    hint: str = ""
    topic: str = ""


def find(
    assignment: Assignment, part: Part, inputs: Arrays, answers: Arrays, expected: Arrays, seconds: float = math.inf
) -> list[Finding]:
    """What is wrong with the answers to a part; nothing if they are right.

    Args:
        seconds: how long the answers of mistakes are computed that are not kept from an earlier call. Then the first
            mistake that fits ends the search. Infinity makes the result the same on every machine.
    """
    right = part.judge.agrees(inputs, answers, expected)
    if right.all():
        return []
    case, clock = WrongAnswers(assignment, part, inputs, answers, expected), TimeLimit(seconds)
    known = assignment.mistakes_of(part)
    single = [(mistake,) for mistake in sketches.likely_first(assignment, part, inputs, answers, known)]
    tried = [one for one in single if is_kept(assignment, part, one, inputs)]
    fitting = [one for one in tried if case.fits(one)]
    for one in (one for one in single if one not in tried):
        if (fitting and seconds < math.inf) or not clock.has_time():
            break
        tried.append(one)
        with clock.running():
            fitting += [one] * case.fits(one)
    if not fitting and len(tried) == len(single):
        fitting = case.fitting_pairs(clock)
    if fitting:
        return [finding_of(part, combination, len(right)) for combination in fitting]
    shown = getattr(part.judge, "told", dict)  # means, in place of the statistics of random answers
    told_of = describe(inputs, shown(answers), shown(expected), right)
    if len(tried) < len(single):
        told_of.append(f"{len(single) - len(tried)} more known mistakes are compared in the next check")
    return [Finding((), float((~right).mean()), text, "", part.topic) for text in told_of]


class TimeLimit:
    """Says whether there is time for one more attempt, which may take as long as the longest so far.

    Args:
        seconds: how long all attempts may take together.
    """

    def __init__(self, seconds: float) -> None:
        self.end, self.longest = time.monotonic() + seconds, 0.0

    def has_time(self) -> bool:
        """Whether another attempt would end in time."""
        return time.monotonic() + self.longest < self.end

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """Take the time of one attempt."""
        start = time.monotonic()
        yield
        self.longest = max(self.longest, time.monotonic() - start)


@dataclass(frozen=True)
class WrongAnswers:
    """Wrong answers to a part, with what is needed to compare them with those of mistakes."""

    assignment: Assignment
    part: Part
    inputs: Arrays
    answers: Arrays
    expected: Arrays

    def answers_of(self, combination: Sequence[Mistake]) -> Arrays | None:
        """What the solution with these mistakes answers."""
        return answers_of(self.assignment, self.part, combination, self.inputs)

    def fits(self, combination: Sequence[Mistake]) -> bool:
        """Whether a combination of mistakes explains every answer, and is a mistake on these inputs at all."""
        wrong = self.answers_of(combination)
        judge = self.part.judge
        if wrong is None or judge.agrees(self.inputs, wrong, self.expected).all():
            return False
        return bool(agree(judge, self.inputs, self.answers, wrong).all())

    def fitting_pairs(self, clock: "TimeLimit") -> list[tuple[Mistake, Mistake]]:
        """The pairs of mistakes that explain every answer; the likely ones are tried first, and only these."""
        fitting: list[tuple[Mistake, Mistake]] = []
        found_at = -1.0
        for likelihood, pair in self.likely_pairs():
            if not clock.has_time() or likelihood < found_at - SAME_LIKELIHOOD:
                break
            with clock.running():
                is_fitting = self.fits(pair)
            if is_fitting:
                fitting.append(pair)
                found_at = max(found_at, likelihood)
        return fitting

    def likely_pairs(self) -> list[tuple[float, tuple[Mistake, Mistake]]]:
        """Pairs with their likelihood, the most likely first.

        If one mistake of a pair leaves a number as it should be, the pair usually gives the number of the other one.
        The likelihood is the share of such numbers at which the student's number is the one that is expected then. Of
        pairs with the same likelihood, that one comes first whose changes, added or multiplied, come nearest.
        """
        judge, singles = self.part.judge, {}
        for mistake in self.assignment.mistakes_of(self.part):
            wrong = self.answers_of((mistake,))
            if wrong is not None:
                right = judge.members(wrong, self.expected)
                singles[mistake] = right, judge.members(self.answers, wrong)
        plain = judge.members(self.answers, self.expected)
        yours, expected = numbers_of(self.answers, self.expected), numbers_of(self.expected, self.expected)
        changed = {mistake: numbers_of(self.answers_of((mistake,)) or {}, self.expected) for mistake in singles}
        pairs = []
        for first, second in itertools.combinations(singles, 2):
            (right_1, like_1), (right_2, like_2) = singles[first], singles[second]
            agree = count = 0
            for name in plain:
                neither, only_1, only_2 = right_1[name] & right_2[name], right_2[name], right_1[name]
                only_1, only_2 = only_1 & ~neither, only_2 & ~neither
                agree += int(
                    (plain[name] & neither).sum() + (like_1[name] & only_1).sum() + (like_2[name] & only_2).sum()
                )
                count += int(neither.sum() + only_1.sum() + only_2.sum())
            far = distance(yours, expected, changed[first], changed[second])
            pairs.append((agree / count if count else 1.0, far, (first, second)))
        pairs.sort(key=lambda pair: (-pair[0], pair[1]))
        return [(likelihood, pair) for likelihood, _, pair in pairs[:MOST_PAIRS]]


def numbers_of(answers: Arrays, expected: Arrays) -> np.ndarray:
    """All numbers of an answer in a row: of random ones, the means. NaN for what has another shape than expected."""
    rows = []
    for name, right in expected.items():
        is_random = np.ndim(right) == 3 and np.shape(right)[1] == 2
        found = np.asarray(answers.get(name, np.nan), np.float64)
        found = found if found.shape == np.shape(right) else np.full(np.shape(right), np.nan)
        rows.append((found[:, 0] if is_random else found).ravel())
    return np.concatenate(rows)


def distance(yours: np.ndarray, expected: np.ndarray, first: np.ndarray, second: np.ndarray) -> float:
    """How far numbers are from what two changes together may give, between 0 and 1.

    Args:
        expected: the right numbers. first, second: the numbers with one change alone.
    """
    with np.errstate(all="ignore"):
        added, multiplied = first + second - expected, first * second / expected
        off = np.fmin(abs(yours - added), abs(yours - multiplied))
        relative = off / (abs(yours) + abs(expected) + abs(first) + abs(second))
    return float(np.clip(np.where(np.isfinite(relative), relative, off != 0), 0, 1).mean())


def finding_of(part: Part, combination: Sequence[Mistake], count: int) -> Finding:
    """The finding of mistakes that explain all answers."""
    names = tuple(mistake.name for mistake in combination)
    called = getattr(part.judge, "called", "inputs")
    text = f"all {count} {called} agree with: {' and '.join(names)}"
    hint = " ".join(mistake.hint for mistake in combination)
    topics = dict.fromkeys(mistake.topic or part.topic for mistake in combination)
    return Finding(names, 1.0, text, hint, ", ".join(topics))


# ── the answers of the solution and of mistakes ──


def kept_expected(assignment: Assignment, part: Part, inputs: Arrays) -> Arrays:
    """What the solution answers, kept as the answers of mistakes are; an InputError if it does not run."""
    if assignment.is_sealed:
        return expected(assignment, part, inputs)
    path = kept_at(assignment, part, (), inputs)
    found = arrays_in(path)
    if not found:
        found = expected(assignment, part, inputs)
        keep_arrays(path, found)
    return found


def answers_of(assignment: Assignment, part: Part, combination: Sequence[Mistake], inputs: Arrays) -> Arrays | None:
    """What the solution with these changes answers; None if the changes exclude each other, or it does not run.

    The answers are kept in ``cache_folder``.
    """
    if assignment.is_sealed:
        return sealed.answers_of_mistake(assignment, combination[0]) if len(combination) == 1 else None
    path = kept_at(assignment, part, combination, inputs)
    known = arrays_in(path)
    if known is not None:
        known.pop(NOTHING, None)
        return known or None
    changed = with_mistakes(assignment, part, combination)
    arrays: Arrays = {}
    if changed is not None:
        with np.errstate(all="ignore"):  # a mistake may divide by 0
            found = answer(part, changed, solution_of(assignment), inputs, dict(assignment.classes))
        arrays = found.arrays if found.status == OK else {}
    keep_arrays(path, arrays or {NOTHING: np.zeros(0)})
    return arrays or None


def with_mistakes(assignment: Assignment, part: Part, combination: Sequence[Mistake]) -> Loaded | None:
    """The classes of the solution with some mistakes in it; None if one mistake removes the place of the other."""
    file = assignment.classes[part.replaces]
    try:
        text = changed_source(assignment, part, combination)
    except InputError:
        if len(combination) == 1:
            raise
        return None
    return load_text(assignment, file, text)


def load_text(assignment: Assignment, file: str, text: str) -> Loaded:
    """The classes of one file of the solution, with another text. Taichi reads it from a temporary file."""
    key = hashlib.sha256(f"{assignment.folder}/{file}/{text}".encode()).hexdigest()[:16]
    folder = Path(work_folder().name) / key
    folder.mkdir(exist_ok=True)
    (folder / file).write_text(text, encoding="utf-8")
    return load_classes(folder, [file], solution_of(assignment))


@cache
def work_folder() -> tempfile.TemporaryDirectory:
    """A folder that is removed when the process ends."""
    return tempfile.TemporaryDirectory(prefix="taichi_tracer_mistakes_")


def changed_source(assignment: Assignment, part: Part, combination: Sequence[Mistake]) -> str:
    """The file of the solution with the changes of some mistakes in the method of a part.

    Raises:
        InputError: a text that is to be changed does not stand exactly once in the method.
    """
    file = assignment.classes[part.replaces]
    path = assignment.solution_folder / file
    source = solved(path.read_text(encoding="utf-8"), str(path))
    before, method, after = split_at_method(source, part.replaces, part.method, str(path))
    for mistake in combination:
        for old, new in mistake.changes:
            count = method.count(old)
            if count != 1:
                where = f"{part.name} of assignment {assignment.name}"
                raise InputError(f"mistake {mistake.name!r}: {old!r} stands {count} times in {where}, not once")
            method = method.replace(old, new)
    return before + method + after


def split_at_method(source: str, class_name: str, method: str, file: str) -> tuple[str, str, str]:
    """A file before the body of a method, this body without its docstring, and the rest."""
    for cls in ast.parse(source).body:
        if not isinstance(cls, ast.ClassDef) or cls.name != class_name:
            continue
        for member in cls.body:
            if isinstance(member, ast.FunctionDef) and member.name == method:
                body = member.body[1:] if ast.get_docstring(member) is not None else member.body
                lines = source.splitlines(keepends=True)
                first, last = body[0].lineno - 1, member.end_lineno or 0
                return "".join(lines[:first]), "".join(lines[first:last]), "".join(lines[last:])
    raise InputError(f"{file}: there is no method {class_name}.{method}")


# ── what is kept between runs ──


def kept_at(assignment: Assignment, part: Part, combination: Sequence[Mistake], inputs: Arrays) -> Path:
    """The file of the answers of some mistakes to some inputs."""
    digest = hashlib.sha256(fingerprint(assignment.folder).encode())
    for word in (assignment.name, part.name, *(mistake.name for mistake in combination)):
        digest.update(f"/{word}".encode())
    for change in (change for mistake in combination for change in mistake.changes):
        digest.update(repr(change).encode())
    for name in sorted(inputs):
        digest.update(name.encode() + np.ascontiguousarray(inputs[name]).tobytes())
    return cache_folder() / f"{digest.hexdigest()[:32]}.npz"


@lru_cache(maxsize=32)
def fingerprint(folder: Path) -> str:
    """A hash of everything that the answers depend on: the assignment, and this package."""
    digest = hashlib.sha256(taichi_tracer.__version__.encode())
    for root in (folder, Path(__file__).parent):
        for path in sorted(root.glob("*.py")) + sorted((root / "solution").glob("*.py")):
            if path.name != "mistakes.py" or root != folder:
                digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


def is_kept(assignment: Assignment, part: Part, combination: Sequence[Mistake], inputs: Arrays) -> bool:
    """Whether the answers of a combination are known from an earlier call."""
    return assignment.is_sealed or kept_at(assignment, part, combination, inputs).exists()


def prepare(assignment: Assignment, seed: int, parts: Iterable[Part] | None = None) -> int:
    """Compute and keep the answers of all single mistakes of some parts, before a class is graded. Returns how many."""
    count = 0
    for part in assignment.parts if parts is None else parts:
        inputs = assignment.inputs(part, seed)
        for mistake in assignment.mistakes_of(part):
            answers_of(assignment, part, (mistake,), inputs)
            count += 1
    return count
