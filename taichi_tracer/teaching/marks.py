"""Marks: the points of each part, what the rules of the course take away, and both as JSON.

The rules stand in one file of JSON. Every entry may be missing:

    {
      "points": {"Camera.generate_ray": 4},      other points than the assignment's own
      "due": "2026-11-20T23:59",                 local time of the machine
      "handed_in": {"123456789": "2026-11-21T08:00"},    otherwise the time of the zip file counts
      "late_percent_per_day": 10,                of the score, for each day that has begun
      "late_days": 5,                            later submissions get nothing
      "misnamed_percent": 5,                     if the name is not <nine digits>.zip
      "import_percent": 100,                     if it breaks the rule of imports; otherwise this is only told
      "imports": ["scipy"]                       modules that are allowed beside those of the solution
    }
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from taichi_tracer.system.errors import InputError, MissingFileError, one_of
from taichi_tracer.teaching.base import RIGHT, Assignment
from taichi_tracer.teaching.submissions import Submission

DIGITS = 2  # of points
SECONDS_PER_DAY = 86400


@dataclass(frozen=True)
class Rules:
    """The rules of a course; see the head of this file."""

    points: Mapping[str, float] = field(default_factory=dict)
    due: datetime | None = None
    handed_in: Mapping[str, datetime] = field(default_factory=dict)
    late_percent_per_day: float = 0.0
    late_days: float = math.inf
    misnamed_percent: float = 0.0
    import_percent: float = 0.0
    imports: tuple[str, ...] = ()

    def points_of(self, assignment: Assignment) -> dict[str, float]:
        """Part → its points."""
        return {part.name: float(self.points.get(part.name, part.points)) for part in assignment.parts}

    def days_late(self, submitted: Submission) -> int:
        """How many days after the date a submission came; a day that has begun counts. 0 if it came in time."""
        if self.due is None:
            return 0
        time = self.handed_in.get(submitted.student)
        if time is None:
            time = datetime.fromtimestamp(submitted.path.stat().st_mtime)
        return max(0, math.ceil((time - self.due).total_seconds() / SECONDS_PER_DAY))


def read_rules(path: Path, assignment: Assignment) -> Rules:
    """The rules of a file; an InputError names the entry that cannot be."""
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise MissingFileError(f"{path}: {error.strerror}") from None
    except ValueError as error:
        raise InputError(f"{path}: this is no JSON: {error}") from None
    known = list(Rules.__dataclass_fields__)
    if not isinstance(values, dict):
        raise InputError(f"{path}: the file has to be an object {{...}} with some of {', '.join(known)}")
    for name in values:
        if name not in known:
            raise InputError(f"{path}: {one_of('rule', name, known)}")
    found = {name: value_of(path, name, value, assignment) for name, value in values.items()}
    return Rules(**found)


def value_of(path: Path, name: str, value: Any, assignment: Assignment) -> Any:
    """One entry of a file of rules."""
    if name == "points":
        points = mapping(path, name, value)
        for part in points:
            assignment.part(part)
        return {part: amount(path, f"points of {part}", number) for part, number in points.items()}
    if name == "due":
        return moment(path, name, value)
    if name == "handed_in":
        return {
            student: moment(path, f"{name} of {student}", time) for student, time in mapping(path, name, value).items()
        }
    if name == "imports":
        if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
            raise InputError(f'{path}: imports is a list of names, such as ["scipy"], not {value!r}')
        return tuple(value)
    return amount(path, name, value)


def mapping(path: Path, name: str, value: Any) -> dict:
    """An object of JSON."""
    if not isinstance(value, dict):
        raise InputError(f"{path}: {name} is an object {{name: value}}, not {value!r}")
    return value


def amount(path: Path, name: str, value: Any) -> float:
    """A number that is not negative."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < math.inf:
        raise InputError(f"{path}: {name} is a number of at least 0, not {value!r}")
    return float(value)


def moment(path: Path, name: str, value: Any) -> datetime:
    """A date and a time."""
    try:
        return datetime.fromisoformat(value).replace(tzinfo=None)
    except (TypeError, ValueError):
        raise InputError(f"{path}: {name} is a time such as 2026-11-20T23:59, not {value!r}") from None


# ── marks ──


@dataclass(frozen=True)
class PartMark:
    """What one part of a submission is worth, and why.

    Attributes:
        name, topic: of the part. points: that a right answer has. share: of them, from 0 to 1.
        status: see ``base.Verdict``. message: one sentence. first_wrong: see ``base.Verdict``.
        findings: what is probably wrong, the fields of ``mistakes.Finding`` each.
        seconds: how long the answer took, with compilation. It is no part of the mark.
    """

    name: str
    topic: str
    points: float
    share: float
    status: str
    message: str = ""
    first_wrong: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    findings: tuple[Mapping[str, Any], ...] = ()
    seconds: float = 0.0

    @property
    def earned(self) -> float:
        """The points that the answer is worth."""
        return round(self.points * self.share, DIGITS)


@dataclass(frozen=True)
class Mark:
    """The mark of one submission.

    Attributes:
        key, student: see ``submissions.Submission``. refused: why it was not unpacked; "" if it was.
        notes: what the report says about the files. imports: what goes against the rule of imports.
        deductions: (reason, percent of the score). level: the walls around it. printed: what it printed, cut.
    """

    key: str
    student: str
    parts: tuple[PartMark, ...]
    refused: str = ""
    notes: tuple[str, ...] = ()
    imports: tuple[str, ...] = ()
    deductions: tuple[tuple[str, float], ...] = ()
    level: str = ""
    printed: str = ""

    @property
    def points(self) -> float:
        """The points that can be had."""
        return round(sum(part.points for part in self.parts), DIGITS)

    @property
    def earned(self) -> float:
        """The points of all parts, before deductions."""
        return round(sum(part.earned for part in self.parts), DIGITS)

    @property
    def score(self) -> float:
        """The points after deductions."""
        percent = min(100.0, sum(percent for _, percent in self.deductions))
        return round(self.earned * (1 - percent / 100), DIGITS)

    @property
    def seconds(self) -> float:
        """How long all parts took."""
        return sum(part.seconds for part in self.parts)

    @property
    def right(self) -> int:
        """How many parts are right."""
        return sum(part.status == RIGHT for part in self.parts)

    def facts(self) -> dict:
        """The mark for JSON, with its sums."""
        parts = [asdict(part) | {"earned": part.earned} for part in self.parts]
        return plain(
            {**asdict(self), "parts": parts, "score": self.score, "earned": self.earned, "points": self.points}
        )


def most_points(marks: Sequence[Mark]) -> float:
    """The points that can be had in a class, with the optional parts that somebody handed in."""
    return max(mark.points for mark in marks)


def mark_of(facts: dict) -> Mark:
    """The mark of what ``Mark.facts`` gave."""
    values = {name: facts[name] for name in Mark.__dataclass_fields__}
    parts = []
    for part in facts["parts"]:
        chosen = {name: part[name] for name in PartMark.__dataclass_fields__}
        parts.append(PartMark(**chosen | {"findings": tuple(part["findings"])}))
    deductions = tuple((reason, percent) for reason, percent in facts["deductions"])
    values |= {"parts": tuple(parts), "deductions": deductions}
    return Mark(**values | {"notes": tuple(facts["notes"]), "imports": tuple(facts["imports"])})


def deductions(rules: Rules, submitted: Submission, imports: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    """What the rules take away from a submission."""
    found = []
    days = rules.days_late(submitted)
    if days:
        percent = 100.0 if days > rules.late_days else min(100.0, days * rules.late_percent_per_day)
        found.append((f"late by {days} day{'s' * (days > 1)}", percent))
    if submitted.is_misnamed and rules.misnamed_percent:
        found.append(("the name is not <nine digits>.zip", rules.misnamed_percent))
    if imports and rules.import_percent:
        found.append(("it breaks the rule of imports", rules.import_percent))
    return tuple(found)


def plain(value: Any) -> Any:
    """A value for JSON: numbers that JSON does not have, such as NaN, become words."""
    if isinstance(value, Mapping):
        return {str(name): plain(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
