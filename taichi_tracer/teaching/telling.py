"""What the process of a check sends to its parent through a pipe: lines of JSON.

{"title", "target"}                                 first: of the page
{"points": {name: points}}                          of the parts that are checked
{"begins": name, "line", "file"}                    a part, whose method stands there; 0 and "" if that is unknown
{"name", "points", "of", "is_right", "html"}        what was found of it, see ``ResultLine``
{"ends": true}                                      last
"""

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

VARIABLE = "TAICHI_TRACER_CHECK_TELLS"  # the number of the pipe, in the environment of the process
GOES_ON = "TAICHI_TRACER_CHECK_GOES_ON"  # is set if an earlier process has begun


@dataclass(frozen=True)
class ResultLine:
    """What is known of one part.

    Attributes:
        points, of: what the answer is worth, and what a right one is worth. html: its box on the page.
    """

    name: str
    points: float
    of: float
    is_right: bool
    html: str


def summary(found: Sequence[ResultLine]) -> str:
    """One line on all parts."""
    right, points, of = sum(t.is_right for t in found), sum(t.points for t in found), sum(t.of for t in found)
    return f"{right} of {len(found)} parts are right: {points:.4g} of {of:g} points"


class Teller:
    """Sends to the parent what this process does; without a parent, it does nothing.

    Attributes:
        has_parent: whether there is one. is_first: whether no process before this one has begun the same check.
    """

    def __init__(self) -> None:
        number = os.environ.pop(VARIABLE, "")
        self.has_parent = number != ""
        self.pipe = os.fdopen(int(number), "w", encoding="utf-8") if number else None
        self.is_first = os.environ.pop(GOES_ON, "") == ""

    def tell(self, **facts: object) -> None:
        """Send a line."""
        if self.pipe is not None:
            self.pipe.write(json.dumps(facts) + "\n")
            self.pipe.flush()

    def found(self, line: ResultLine) -> None:
        """Send what was found of a part."""
        self.tell(**asdict(line))

    def begins(self, name: str, method: Any) -> None:
        """Say which part is run, and where its method stands, if the student has written one."""
        code = getattr(method, "__code__", None)
        line, file = (code.co_firstlineno, Path(code.co_filename).name) if code is not None else (0, "")
        self.tell(begins=name, line=line, file=file)
