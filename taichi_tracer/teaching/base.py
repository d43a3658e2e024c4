"""What an assignment consists of: parts, each of which is one method with its inputs, and a judge of its numbers.

A part is run where the student's code is, and judged where it is not. ``Part.run`` gets a class and arrays, and returns
arrays. ``Part.judge`` compares these with the arrays that the solution gives on the same inputs, and needs numpy alone.
"""

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


@dataclass(frozen=True)
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
        judge: (inputs, answers, expected answers) → PartResult. It has the method ``agrees`` too, see ``judges``.
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
        changes: (old, new) texts. Each old text must stand exactly once in the method.
    """

    part: str
    name: str
    hint: str
    changes: tuple[tuple[str, str], ...]


def by_part(known: Mapping[str, Mapping[str, tuple]]) -> tuple[Mistake, ...]:
    """The known mistakes of parts: name of the part → name of the mistake → (hint, change, change …)."""
    of_all = [(part, name, entry) for part, named in known.items() for name, entry in named.items()]
    return tuple(Mistake(part, name, hint, tuple(changes)) for part, name, (hint, *changes) in of_all)


@dataclass(frozen=True)
class Assignment:
    """An assignment: its parts, the files that a student hands in, its solution and its known mistakes.

    Attributes:
        name: "a1", or the name of the folder.
        title: a line for the reports.
        folder: where its README.md, ``parts.py``, ``mistakes.py`` and the folder ``solution`` are.
        files: the files that a student hands in, such as "camera.py".
        classes: name of a class that the student writes → the file that it is in.
        program: the file of the solution that opens a window, such as "A1.py"; "" if there is none.
        is_sealed: whether there is no solution, but only its answers; see ``sealed``.
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
    def solution_folder(self) -> Path:
        """The folder of the tagged solution."""
        return self.folder / "solution"

    @property
    def points(self) -> float:
        """The points of all parts but the optional ones."""
        return sum(part.points for part in self.parts if not part.is_optional)

    @property
    def optional(self) -> frozenset[str]:
        """The names of the optional parts."""
        return frozenset(part.name for part in self.parts if part.is_optional)

    def part(self, name: str) -> Part:
        """The part of this name; an InputError that lists the parts if there is none."""
        for part in self.parts:
            if part.name == name:
                return part
        raise one_of("part", name, [part.name for part in self.parts])

    def mistakes_of(self, part: Part) -> tuple[Mistake, ...]:
        """The known mistakes of a part."""
        return tuple(mistake for mistake in self.mistakes if mistake.part == part.name)

    def rng(self, part: Part, seed: int) -> np.random.Generator:
        """The random numbers from which the inputs of a part are made. They differ between parts and between seeds."""
        return np.random.default_rng([seed, zlib.crc32(f"{self.name}/{part.name}".encode())])

    def inputs(self, part: Part, seed: int) -> Arrays:
        """The inputs of a part."""
        return part.inputs(self.rng(part, seed))


def check_parts(name: str, parts: tuple[Part, ...], classes: Mapping[str, str]) -> None:
    """Raise an InputError if the parts of an assignment do not fit together."""
    for part in parts:
        if part.replaces and part.replaces not in classes:
            raise InputError(
                f"assignment {name}: the part {part.name!r} tests the class {part.replaces}, which is in no file: "
                f"the classes are {', '.join(classes)}"
            )
