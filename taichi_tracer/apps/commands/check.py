"""Check your own solution of an assignment.

A check runs in a process of its own: a part that gives no answer, or that ends its process, loses nothing but itself.
The process prints what it finds, and tells its parent by a pipe which part it begins and what was found of it, see
``teaching.telling``. The parent ends it if a part takes too long, or if the user presses Ctrl-C, and starts another one
for the parts that are left. A kernel that never ends cannot be stopped in another way: while it runs, Python sees no
signal.
"""

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import time
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from taichi_tracer.apps.grammar import Parser
from taichi_tracer.apps.notes import USER_ERROR
from taichi_tracer.apps.running import Interruption
from taichi_tracer.system.argument_types import whole
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.threads import own_seconds
from taichi_tracer.teaching.telling import GOES_ON, VARIABLE, ResultLine, summary

# A part may use so many seconds of the processor, and of the clock. Those of the shipped assignments compile and run in
# less than 6. The clock alone counts where the system does not tell the seconds of other processes.
CPU_SECONDS, CLOCK_SECONDS = 20.0, 90.0
POLL = 0.1  # seconds between two looks
PAGE = "check.html"
NOT_RIGHT = 1  # the exit code if a part is not right


def add_arguments(parser: Parser) -> None:
    """Add what ``check`` takes."""
    parser.add_argument(
        "folder", metavar="DIR", nargs="?", default=".", help="that assignment new wrote (default: here)"
    )
    parser.add_argument("names", metavar="PART", nargs="*", help="only these: a method, a class or a picture")
    parser.add_argument("--assignment", metavar="NAME", help="of files of the course: a1, a2, a3 or a4")
    parser.add_argument("--seed", type=whole, metavar="N", help="of the inputs (default: that of the folder)")
    parser.add_argument("--report", metavar="FILE", help="page to write (default: DIR/check.html)")


def run(args: Namespace) -> int:
    """Check a folder; print each part as soon as it is known, and write a page."""
    if os.name == "posix" and VARIABLE not in os.environ:
        given = (("--assignment", args.assignment), ("--seed", args.seed), ("--report", args.report))
        options = [word for name, value in given if value is not None for word in (name, str(value))]
        options += ["--debug"] * args.debug
        return supervise(args.folder, args.names, options)
    return run_here(args)


def run_here(args: Namespace) -> int:
    """The same in this process, which tells its parent what it does, or writes the page itself if it has none."""
    from taichi_tracer.files.disk import check_place
    from taichi_tracer.teaching.checking import assignment_of, check_folder
    from taichi_tracer.teaching.telling import Teller

    folder = Path(args.folder).expanduser()
    target, teller = Path(args.report) if args.report else folder / PAGE, Teller()
    assignment, _ = assignment_of(folder, args.assignment)
    check_place(target)
    if teller.is_first:
        print(assignment.title, flush=True)

    def tell(lines: list[str]) -> None:
        """Print what was found of a part."""
        print(*lines, sep="\n", end="\n" * bool(lines), flush=True)

    teller.tell(title=assignment.title, target=str(target))
    report = check_folder(folder, args.names, args.seed, tell, args.assignment, teller)
    teller.tell(ends=True)
    return 0 if teller.has_parent else finished(report.assignment.title, target, report.result_lines())


class Supervised:
    """A process that checks some parts.

    Attributes:
        about: its first line. found: what it found of parts. present: the part that runs; None if none does.
        has_ended: whether it has done all that it had to do.
        problem: what is wrong with the present part, which gave no answer. is_late: whether it has used up its time.

    Args:
        words: of its command. goes_on: whether another process has begun. interruption: ends the check by Ctrl-C.
    """

    def __init__(self, words: Sequence[str], goes_on: bool, interruption: Interruption) -> None:
        self.interruption = interruption
        reading, writing = os.pipe()
        environment = {**os.environ, VARIABLE: str(writing), **({GOES_ON: "1"} if goes_on else {})}
        command = [sys.executable, "-m", "taichi_tracer", "check", *words]
        self.process = subprocess.Popen(command, env=environment, pass_fds=(writing,), start_new_session=True)
        os.close(writing)
        self._pipe, self._rest = reading, b""
        self.about: dict[str, Any] = {}
        self.found: list[ResultLine] = []
        self.present: dict[str, Any] | None = None
        self.has_ended = self.is_late = False
        self.problem = ""
        self._begin()

    def run(self) -> None:
        """Wait until it ends, or until a part takes too long."""
        while self._is_open() and not self.problem:
            self._look()
        if self.problem:
            return
        code = self.process.wait()
        if self.present is not None and code != USER_ERROR:  # the process has printed it
            how = next((one.name for one in signal.Signals if one == -code), f"exit code {code}")
            self.problem = f"{self._where()}the process ended ({how}): does each path return what the caller needs?"

    def _is_open(self) -> bool:
        """Read what has come; whether more may come."""
        ready, _, _ = select.select([self._pipe], [], [], POLL)
        if not ready:
            return True
        data = os.read(self._pipe, 1 << 16)
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            self._take(json.loads(line))
        return bool(data)

    def _take(self, facts: dict[str, Any]) -> None:
        if "begins" in facts:
            self.present = facts
            self._begin()
        elif "name" in facts:
            self.found.append(ResultLine(**facts))
            self.present = None
            self._begin()
        elif "ends" in facts:
            self.has_ended = True
        else:
            self.about |= facts

    def _begin(self) -> None:
        self._began, self._had_used = time.monotonic(), own_seconds(self.process.pid)

    def _look(self) -> None:
        """Look how long the present part has taken, or what comes before the first one."""
        if self.interruption.number is not None:
            raise KeyboardInterrupt
        clock, used = time.monotonic() - self._began, own_seconds(self.process.pid) - self._had_used
        if used > CPU_SECONDS or clock > CLOCK_SECONDS:
            seconds = f"{CPU_SECONDS:g} s of the processor" if used > CPU_SECONDS else f"{CLOCK_SECONDS:g} s"
            self.problem = f"{self._where()}no answer in {seconds}: is there a loop that never ends?"
            self.is_late = True

    def _where(self) -> str:
        """Where the method of the present part stands."""
        of = self.present or {}
        return f"{of['file']}:{of['line']}: " if of.get("line") else ""

    def left(self) -> list[str]:
        """The names of the parts that it has not begun."""
        begun = {one.name for one in self.found} | ({self.present["begins"]} if self.present else set())
        return [name for name in self.about["points"] if name not in begun]

    def end(self) -> None:
        """End the process, and everything that it started."""
        if self.process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        if self._pipe >= 0:
            os.close(self._pipe)
            self._pipe = -1


def supervise(folder: str, names: Sequence[str], options: Sequence[str]) -> int:
    """Check a folder in processes of their own, one after the other if a part ends one, and write the page.

    Args:
        names: of parts; all if there are none. options: further words of the command.

    Returns:
        The exit code of the command.

    Raises:
        InputError: the files give no answer when they are read.
    """
    found: list[ResultLine] = []
    with Interruption() as interruption:
        while True:
            one = Supervised([folder, *names, *options], bool(found), interruption)
            try:
                one.run()
            finally:
                one.end()
            found += one.found
            if one.problem:
                if one.present is None:
                    raise InputError(f"check: the files cannot be read: {one.problem}")
                found.append(lost(one))
                names = one.left()
            elif not one.has_ended:
                return one.process.returncode
            if one.has_ended or not names:
                break
    return finished(one.about["title"], Path(one.about["target"]), found)


def lost(one: Supervised) -> ResultLine:
    """Print, and return, the result of a part that gave no answer."""
    from taichi_tracer.teaching.base import CRASHED, OUT_OF_TIME, PartResult
    from taichi_tracer.teaching.html_boxes import lines_of, result_line

    name = (one.present or {})["begins"]
    status = OUT_OF_TIME if one.is_late else CRASHED
    result = PartResult(status, message=one.problem, name=name, points=one.about["points"][name])
    print(*lines_of(result), sep="\n", flush=True)
    return result_line(result)


def finished(title: str, target: Path, found: Sequence[ResultLine]) -> int:
    """Write the page, and print the summary. Returns the exit code."""
    from taichi_tracer.files import page
    from taichi_tracer.files.disk import replace_file
    from taichi_tracer.teaching import html_boxes

    text = summary(found)
    body = [page.paragraph(text), *(one.html for one in found)]
    replace_file(target, html_boxes.whole(title, body).encode())
    print(f"{text}\n{target}")
    return 0 if all(t.is_right for t in found) else NOT_RIGHT
