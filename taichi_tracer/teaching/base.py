"""What an assignment consists of: parts, each of which is one method with its inputs, and a judge of its numbers.

A part is run where the student's code is, and judged where it is not. ``Part.run`` gets a class and arrays, and returns
arrays. ``Part.judge`` compares these with the arrays that the solution gives on the same inputs, and needs numpy alone:
number by number within a tolerance, by statistics, or as pictures. The judge of a method can be called as ``judge``
describes, and has ``agrees``: (inputs, answers, expected) → (n,) bool, one for each input that is judged by itself. The
mistake finder asks ``agrees``, too.
"""

import os
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.system.errors import InputError, one_of

Arrays = dict[str, np.ndarray]

RIGHT, WRONG, NOT_WRITTEN, CRASHED = "right", "wrong", "not written", "crashed"
OUT_OF_TIME, MISSING, BEGUN = "out of time", "missing", "begun"
DIGITS = 2  # of points
STATUSES = (RIGHT, WRONG, NOT_WRITTEN, CRASHED, OUT_OF_TIME, MISSING)


@dataclass(frozen=True)
class PartResult:
    """What was found about one part: by running it, by its judge, and for a mark.

    Attributes:
        status: one of ``STATUSES``; "ok" if it gave answers that are not judged yet; ``BEGUN`` while it runs.
        share: the share of the points, from 0 to 1.
        message: one plain sentence. line, file: where a crash was, in the student's file; 0 and "" if that is unknown.
            Of a part that runs, where its method begins.
        first_wrong: "input", "yours" and "right": name → value, for the first input with a wrong answer; or empty.
        pictures: "yours", "right" and "difference": (height, width, 3) arrays with the top row first; or empty.
        arrays: the answers, until they are judged.
        name, topic, points: of the part; points are those of a right answer.
        findings: what is probably wrong, each with "names" (that of the known mistake; empty if the error is only
            described), "text" (a sentence), and "hint" (a sentence that leads to the solution, or "").
        seconds: how long the answer took, with compilation. It is no part of the mark.
    """

    status: str
    share: float = 0.0
    message: str = ""
    first_wrong: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    pictures: Mapping[str, np.ndarray] = field(default_factory=dict)
    arrays: Arrays = field(default_factory=dict)
    line: int = 0
    file: str = ""
    name: str = ""
    topic: str = ""
    points: float = 0.0
    findings: tuple[Mapping[str, Any], ...] = ()
    seconds: float = 0.0

    @property
    def earned(self) -> float:
        """The points that the answer is worth."""
        return round(self.points * self.share, DIGITS)


@dataclass(frozen=True, eq=False)
class Part:
    """One method of the handout, or one picture.

    Attributes:
        name: class and method, "Camera.generate_ray"; or "picture: normal".
        points: how much a right answer is worth.
        topic: the topic of the lecture that explains it.
        replaces: the name of the class that has the method; "" if ``run`` gets all classes, as a picture does.
        inputs: a numpy random generator → the inputs. An array that has as many rows as the answers belongs to them
            row by row; smaller arrays belong to all of them.
        run: (the class, inputs) → answers.
        judge: (inputs, answers, expected answers) → PartResult. That of a method has ``agrees``, too.
        is_optional: whether it only counts if it is handed in: a part for graduate students.
    """

    name: str
    points: float
    topic: str
    replaces: str
    inputs: Callable[[np.random.Generator], Arrays]
    run: Callable[[Any, Arrays], Arrays]
    judge: Any
    is_optional: bool = False

    @property
    def method(self) -> str:
        """The name of the method; "" for a picture."""
        return self.name.rpartition(".")[2] if self.replaces else ""


def method(name: str, points: float, topic: str, inputs: Callable, run: Callable, judge: Any) -> Part:
    """The part of one method: its name says of which class it is, as in "Camera.generate_ray"."""
    return Part(name, points, topic, name.partition(".")[0], inputs, run, judge)


def optional(part: Part) -> Part:
    """The same part, for whoever wants it: a hand-in without it loses nothing."""
    return replace(part, is_optional=True)


@dataclass(frozen=True)
class Mistake:
    """A known mistake: a small change of the solution.

    Attributes:
        part: the name of the part whose method is changed.
        name: what is wrong, in the words of a report: "pixel corner instead of centre".
        hint: a sentence that leads a student towards the solution without giving it away.
        changes: (old, new) texts. Each old text must stand exactly once in the solution of the method.
    """

    part: str
    name: str
    hint: str
    changes: tuple[tuple[str, str], ...]

    def applied(self, solution: str) -> str:
        """The lines of a solution with this mistake; an InputError if an old text does not stand exactly once in it."""
        for old, new in self.changes:
            count = solution.count(old)
            if count != 1:
                raise InputError(f"mistake {self.name!r}: {old!r} stands {count} times in {self.part}, not once")
            solution = solution.replace(old, new)
        return solution


@dataclass(frozen=True, eq=False)
class Assignment:
    """An assignment: its parts, the files that a student hands in, its solution and its known mistakes.

    Attributes:
        name: "a1", or the name of the folder.
        title: a line for the reports.
        folder: where its README.md, ``parts.py``, ``mistakes.py`` and the folder ``solution``, which has tags, are.
        files: the files that a student hands in, such as "camera.py".
        classes: name of a class that the student writes → the file that it is in.
        program: the file of the solution that opens a window, such as "A1.py"; "" if there is none.
        is_sealed: whether there is no solution, but only its answers; see ``catalogue.answers_in``.
    """

    name: str
    title: str
    folder: Path
    parts: tuple[Part, ...]
    files: tuple[str, ...]
    classes: Mapping[str, str]
    mistakes: tuple[Mistake, ...] = ()
    program: str = ""
    is_sealed: bool = False

    @property
    def points(self) -> float:
        """The points of all parts but the optional ones."""
        return sum(part.points for part in self.parts if not part.is_optional)

    def part(self, name: str) -> Part:
        """The part of this name; an InputError that lists the parts if there is none."""
        for part in self.parts:
            if part.name == name:
                return part
        raise one_of("part", name, [part.name for part in self.parts])

    def inputs(self, part: Part, seed: int) -> Arrays:
        """The inputs of a part: their random numbers differ between parts and between seeds."""
        return part.inputs(np.random.default_rng([seed, zlib.crc32(f"{self.name}/{part.name}".encode())]))


# ── judges ──


class JudgeOfRows:
    """A judge whose inputs are judged row by row.

    Attributes:
        called: what one input is called in messages.
        agrees: (inputs, answers, expected) → (n,) bool: the inputs all of whose answers are right.
    """

    called: str
    agrees: Callable[..., np.ndarray]

    def __call__(self, inputs: Arrays, answers: Arrays, expected: Arrays) -> PartResult:
        """Right if all inputs agree; otherwise the share of those that do, and the first that does not."""
        agrees = self.agrees(inputs, answers, expected)
        if agrees.all():
            return PartResult(RIGHT, 1.0, f"all {len(agrees)} {self.called} are right")
        first = int(np.argmin(agrees))
        message = f"{int((~agrees).sum())} of {len(agrees)} {self.called} are wrong"
        wrong = first_wrong(inputs, self.means_of(answers), self.means_of(expected), first, len(agrees))
        return PartResult(WRONG, self.earned(inputs, answers, expected), message, wrong)

    def means_of(self, answers: Arrays) -> Arrays:
        """What a report shows of answers."""
        return answers

    def earned(self, inputs: Arrays, answers: Arrays, expected: Arrays) -> float:
        """The share of the points of answers that are not all right: see ``beyond_chance``."""
        count = len(next(iter(expected.values())))
        tried = [{name: np.zeros_like(right) for name, right in expected.items()}]
        for row in range(0, count, -(-count // CONSTANTS)):
            tried.append({name: np.broadcast_to(right[row], right.shape) for name, right in expected.items()})
        chance = max(float(self.agrees(inputs, one, expected).mean()) for one in tried)
        return beyond_chance(float(self.agrees(inputs, answers, expected).mean()), chance)


def beyond_chance(share: float, chance: float) -> float:
    """A share of right answers, less what is right by chance: 0 for the share ``chance``, and 1 for 1.

    Args:
        chance: the share that the best answer gets which is the same for every input, such as "no ray hits anything".
    """
    return max(0.0, (share - chance) / (1 - chance)) if chance < 1 else 0.0


@dataclass(frozen=True)
class Numbers(JudgeOfRows):
    """Every input has one right answer, up to rounding.

    Attributes:
        tolerance: the largest error that counts as rounding, as a multiple of 1 or of the right number, whichever is
            larger.
        only_where: the name of an answer that says whether the other answers of the same row count: where it is 0, as
            ``is_hit`` of a miss, only itself is compared.
        called: what one input is called in messages, "pixels" or "rays".
    """

    tolerance: float = 1e-4
    only_where: str = ""
    called: str = "inputs"

    def agrees(self, inputs: Arrays, answers: Arrays, expected: Arrays) -> np.ndarray:
        """(n,) bool: the inputs all of whose answers are right."""
        count = len(next(iter(expected.values())))
        found = np.ones(count, bool)
        counts = np.asarray(expected[self.only_where]).reshape(count) != 0 if self.only_where else found.copy()
        for name, right in expected.items():
            if np.shape(answers.get(name)) != np.shape(right):
                return np.zeros(count, bool)
            same = self._same(np.asarray(answers[name]), np.asarray(right)).reshape(count, -1).all(axis=1)
            found &= same if name == self.only_where else same | ~counts
        return found

    def _same(self, yours: np.ndarray, right: np.ndarray) -> np.ndarray:
        if right.dtype.kind in "iub":
            return yours == right
        yours, right = yours.astype(np.float64), right.astype(np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            near = abs(yours - right) <= self.tolerance * np.maximum(1, abs(right))
        near &= np.isfinite(right)  # nothing but infinity is near infinity
        return near | (yours == right) | (np.isnan(yours) & np.isnan(right))


# The largest |z| of a test that passes. With 400 tests in a submission, the false-alarm rate is below 1e-6 for normal
# means; means of 10⁴ and more bounded samples are close enough to normal that it stays below 1e-4.
CONSTANTS = 16  # right answers that are tried for all inputs alike
MOST_NOISE = 4.0  # standard errors of a submission, in units of those of the solution
LARGEST_Z = 6.0
ROUNDING = 1e-5  # the error of a mean in f32, relative to its size, or to 1


def statistics(samples: np.ndarray) -> np.ndarray:
    """(n, m, d) samples of n inputs → (n, 2, k): means of k numbers, and the squares of their standard errors.

    The k numbers are the d numbers of a sample, their squares, the products of two different ones, and the sum of their
    fourth powers. These are what a part with random answers returns for ``Samples``.
    """
    x = np.asarray(samples, np.float64)
    d = x.shape[2]
    columns = [x[..., i] for i in range(d)] + [x[..., i] ** 2 for i in range(d)]
    columns += [x[..., i] * x[..., j] for i in range(d) for j in range(i + 1, d)]
    columns.append((x**4).sum(axis=2))
    with np.errstate(invalid="ignore", over="ignore"):
        means = [column.mean(axis=1) for column in columns]
        squared_errors = [column.var(axis=1) / x.shape[1] for column in columns]
    return np.stack([np.stack(means, axis=1), np.stack(squared_errors, axis=1)], axis=1)


def length_of(samples: np.ndarray) -> np.ndarray:
    """(n, 1) of (n, m, 3) samples of n inputs: the length, of the m vectors of an input, that is farthest from 1."""
    lengths = np.linalg.norm(np.asarray(samples, np.float64), axis=2)
    farthest = np.abs(np.nan_to_num(lengths, nan=np.inf) - 1).argmax(axis=1)
    return np.take_along_axis(lengths, farthest[:, None], axis=1)


@dataclass(frozen=True)
class Samples(JudgeOfRows):
    """Random answers: the means of many samples are compared with those of the solution, by z-tests.

    A random answer is what ``statistics`` returns.

    Attributes:
        exact: the names of the answers that are not random: one row of numbers for each input, as for ``Numbers``.
        called: what one input is called in messages.
        only_means: whether samples may be distributed in another way than the solution's, with the same mean: as with
            another way to choose between light and BRDF.
        for_means: the share of the points of samples that have the right means, and another distribution: as with a
            roulette that begins one bounce later.

    The standard errors of means are at most ``MOST_NOISE`` times the solution's, so that nothing passes because it is
    noise.
    """

    exact: tuple[str, ...] = ()
    called: str = "inputs"
    only_means: bool = False
    for_means: float = 0.0

    def agrees(self, inputs: Arrays, answers: Arrays, expected: Arrays) -> np.ndarray:
        """(n,) bool: the inputs all of whose tests pass."""
        found = np.ones(len(next(iter(expected.values()))), bool)
        for name, right in expected.items():
            if name in self.exact:
                found &= Numbers().agrees(inputs, answers, {name: right})
            elif np.shape(answers.get(name)) != np.shape(right):
                return np.zeros_like(found)
            else:
                yours, own = np.asarray(answers[name], np.float64), np.asarray(right, np.float64)
                means = slice(dimensions(right.shape[2]))
                if self.only_means:
                    yours, own = yours[:, :, means], own[:, :, means]
                most = MOST_NOISE**2 * own[:, 1] + (ROUNDING * np.maximum(1, abs(own[:, 0]))) ** 2
                noisy = ~(yours[:, 1] <= most) & ~(np.isnan(yours[:, 0]) & np.isnan(own[:, 0]))
                noisy = noisy[:, means].any(axis=1)  # errors of squares vary too much with a few large samples
                found &= (abs(z_scores(yours, own)) <= LARGEST_Z).all(axis=1) & ~noisy
        return found

    def __call__(self, inputs: Arrays, answers: Arrays, expected: Arrays) -> PartResult:
        """Right if all tests pass; otherwise the mean of the first input that fails, beside the right mean."""
        result = super().__call__(inputs, answers, expected)
        if self.for_means > result.share and replace(self, only_means=True).agrees(inputs, answers, expected).all():
            message = f"{result.message}, but their means are right"
            return replace(result, share=self.for_means, message=message)
        return result

    def means_of(self, answers: Arrays) -> Arrays:
        """What a report shows of answers: exact ones as they are; means and standard deviations of random ones."""
        shown = {name: array for name, array in answers.items() if name in self.exact}
        for name, array in answers.items():
            if name not in self.exact and np.ndim(array) == 3 and array.shape[1] == 2:
                d = dimensions(array.shape[2])
                mean, of_squares = array[:, 0, :d], array[:, 0, d : 2 * d]
                shown[f"mean {name}"] = mean
                shown[f"deviation of {name}"] = np.sqrt(np.maximum(0, of_squares - mean**2))
        return shown


def dimensions(count: int) -> int:
    """How many numbers d a sample has, if its ``statistics`` have ``count`` = 2 d + d (d − 1)/2 + 1 numbers."""
    return next((d for d in range(1, 10) if 2 * d + d * (d - 1) // 2 + 1 == count), 1)


def z_scores(yours: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(n, 2, k) statistics twice → (n, k): the differences of the means in standard errors.

    Answers that are not finite give infinity; 0 if both are NaN, as that of a mistake and that of a student may be.
    """
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        scale = np.maximum(1, abs(right[:, 0]))
        error = np.sqrt(yours[:, 1] + right[:, 1] + (ROUNDING * scale) ** 2)
        z = (yours[:, 0] - right[:, 0]) / error
    z = np.where(np.isfinite(z), z, np.inf)
    z[np.isnan(yours[:, 0]) & np.isnan(right[:, 0])] = 0
    return z


PIXEL_ROUNDING = 2e-3  # the largest error of a pixel that counts as rounding, relative to its size, or to 1
ALLOWED = 0.01  # the share of the pixels that may differ: edges between triangles may fall on either side


def compare_pictures(inputs: Arrays, answers: Arrays, expected: Arrays) -> PartResult:
    """Right if at most ``ALLOWED`` of the pixels differ; both pictures and their difference in any case.

    In random pictures, which have "error" among the answers, pixels may differ by ``LARGEST_Z`` standard errors more.
    """
    right, yours = np.asarray(expected["picture"], np.float64), np.asarray(answers.get("picture"))
    if yours.shape != right.shape:
        return PartResult(WRONG, 0.0, f"the picture has the shape {yours.shape}, not {right.shape}")
    yours = yours.astype(np.float64)
    largest = PIXEL_ROUNDING * np.maximum(1, abs(right))
    if "error" in expected:
        errors = (np.asarray(found.get("error", 0), np.float64) for found in (answers, expected))
        largest = largest + LARGEST_Z * np.hypot(*errors)
    share = float((abs(yours - right) <= largest).all(axis=2).mean())
    pictures = {"yours": yours, "right": right, "difference": abs(yours - right)}
    if share >= 1 - ALLOWED:
        return PartResult(RIGHT, 1.0, "the picture is right", {}, pictures)
    _, counts = np.unique(np.round(right.reshape(-1, 3), 3), axis=0, return_counts=True)
    chance = float(counts.max() / counts.sum())  # what a picture of one colour would get
    message = f"{(1 - share):.0%} of the pixels are wrong"
    return PartResult(WRONG, beyond_chance(share, chance), message, {}, pictures)


def picture(view: str, points: float, inputs: Callable, run: Callable) -> Part:
    """The part of a picture that all of the student's classes make."""
    return Part(f"picture: {view}", points, "the whole pipeline", "", inputs, run, compare_pictures)


def first_wrong(inputs: Arrays, answers: Arrays, expected: Arrays, i: int, count: int) -> dict[str, dict]:
    """The i-th input with both answers, as numbers that can be shown."""
    of_all = {name: shown(a) for name, a in inputs.items() if len(np.atleast_1d(a)) != count and np.size(a) <= 12}
    of_this = {name: shown(np.asarray(a)[i]) for name, a in inputs.items() if len(np.atleast_1d(a)) == count}
    yours = {name: shown(np.asarray(a)[i]) for name, a in answers.items() if len(np.atleast_1d(a)) == count}
    right = {name: shown(np.asarray(a)[i]) for name, a in expected.items()}
    return {"input": {**of_this, **of_all}, "yours": yours, "right": right}


def shown(value: np.ndarray | float) -> object:
    """An array as numbers with six digits, or nested lists of them; in words, as "nan", where JSON has no number."""
    array = np.asarray(value)
    if array.size != 1:
        return [shown(part) for part in array]
    number = array.reshape(-1)[0]
    digits = f"{number:.6g}"
    return int(number) if array.dtype.kind in "iub" else float(digits) if np.isfinite(number) else digits


# ── groups of arrays, and the folder of what is kept ──


VARIABLE = "TAICHI_TRACER_CACHE"  # the environment variable that names another folder for what is kept between runs


def cache_folder() -> Path:
    """Where compiled kernels are kept: the folder in TAICHI_TRACER_CACHE, or one in the user's cache."""
    own = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "taichi_tracer"
    return Path(os.environ.get(VARIABLE) or own) / "teaching"


def joined(groups: Mapping[str, Arrays]) -> Arrays:
    """The arrays of several groups in one: "GROUP/NAME" → array."""
    return {f"{group}/{name}": array for group, arrays in groups.items() for name, array in arrays.items()}


def parted(arrays: Arrays) -> dict[str, Arrays]:
    """The groups that ``joined`` put together."""
    groups: dict[str, Arrays] = {}
    for key, array in arrays.items():
        group, _, name = key.rpartition("/")
        groups.setdefault(group, {})[name] = array
    return groups
