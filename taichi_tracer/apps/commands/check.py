"""Check your own solution of an assignment.

A check runs in a process of its own: a part that gives no answer, or that ends its process, loses nothing but itself.
The process sends each part to its parent, when it begins and when it is judged. The parent prints what was found. It
ends the process if a part takes too long, or if the user presses Ctrl-C, and starts another one for the parts that are
left. A kernel that never ends cannot be stopped in another way: while it runs, Python sees no signal.
"""

import contextlib
import multiprocessing
import os
import signal
import sys
import time
from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from taichi_tracer.apps.console import Parser
from taichi_tracer.apps.running import Interruption
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.system.argument_types import whole
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import BEGUN, CRASHED, OUT_OF_TIME, PartResult
from taichi_tracer.teaching.html_boxes import Report, lines_of

# A part may use so many seconds of the processor, and of the clock. Those of the shipped assignments compile and run in
# less than 6. The clock alone counts where the system does not tell the seconds of other processes.
CPU_SECONDS, CLOCK_SECONDS = 20.0, 90.0
POLL = 0.1  # seconds between two looks
OWN = 11, 15  # fields of /proc/<pid>/stat after the name: user, system, and both of the children that have ended
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
    folder, names, report = Path(args.folder).expanduser(), args.names, None
    target = Path(args.report) if args.report else folder / PAGE
    with Interruption() as interruption:
        while report is None or names:
            with contextlib.closing(answers((folder, names, args.seed, args.assignment), interruption)) as found:
                title, names = next(found)
                if report is None:
                    check_place(target)
                    print(title, flush=True)
                    report = Report(title)
                for result in found:
                    report.results.append(result)
                    print(*lines_of(report.shown()[-1]), sep="\n", flush=True)
            names = [name for name in names if name not in {result.name for result in report.results}]
    replace_file(target, report.page().encode())
    print(f"{report.summary()}\n{target}")
    return 0 if report.is_right else NOT_RIGHT


def work(sending: Connection, *asked: Any) -> None:
    """What the process of a check does, see ``checking.check_folder``; it sends an error of the user's, or None."""
    from taichi_tracer.teaching.checking import check_folder

    if hasattr(os, "setsid"):
        os.setsid()  # so that Ctrl-C reaches the parent alone, and what a part starts ends with this process
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]  # prints of the part stand before its line
    try:
        check_folder(*asked, sending.send)
        sending.send(None)
    except (InputError, OSError) as error:
        sending.send(InputError(str(error)))


class NoAnswer(Exception):
    """The status of a part whose process gives no answer, and the reason."""


def answers(asked: Sequence[Any], interruption: Interruption) -> Iterator[Any]:
    """What a process that checks some parts finds: a title and the names of the parts, then the result of each part.

    If the process gives no answer any more, the part that it has begun is the last one.

    Args:
        asked: the arguments of ``work``. interruption: ends the check by Ctrl-C.

    Raises:
        InputError: it has begun no part, so its files give no answer when they are read.
    """
    context = multiprocessing.get_context("spawn")
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(sending, *asked))
    process.start()
    sending.close()
    begun: PartResult | None = None
    try:
        while (found := receive(process, receiving, interruption)) is not None:
            is_begun = isinstance(found, PartResult) and found.status == BEGUN
            begun = found if is_begun else None
            if not is_begun:
                yield found
        process.join(CLOCK_SECONDS)
    except NoAnswer as no_answer:
        status, reason = no_answer.args
        if begun is None:
            raise InputError(f"check: the files cannot be read: {reason}") from None
        place = f"{begun.file}:{begun.line}: " if begun.line else ""
        yield replace(begun, status=status, message=f"{place}{reason}")
    finally:
        if process.is_alive() and hasattr(os, "killpg"):  # and everything that it started
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.join()


def receive(process: Any, receiving: Connection, interruption: Interruption) -> Any:
    """What a process sends next.

    Raises:
        NoAnswer: it takes too long, or has ended. InputError: it sends one.
    """
    began, had_used = time.monotonic(), own_seconds(process.pid)
    while not receiving.poll(POLL):
        if interruption.number is not None:
            raise KeyboardInterrupt
        is_late = own_seconds(process.pid) - had_used > CPU_SECONDS
        if is_late or time.monotonic() - began > CLOCK_SECONDS:
            seconds = f"{CPU_SECONDS:g} s of the processor" if is_late else f"{CLOCK_SECONDS:g} s"
            raise NoAnswer(OUT_OF_TIME, f"no answer in {seconds}: is there a loop that never ends?")
    try:
        found = receiving.recv()
    except EOFError:
        process.join()
        code = process.exitcode
        how = next((one.name for one in signal.Signals if one == -code), f"exit code {code}")
        reason = f"the process ended ({how}): does each path return what the caller needs?"
        raise NoAnswer(CRASHED, reason) from None
    if isinstance(found, InputError):
        raise found
    return found


def own_seconds(pid: int) -> float:
    """Processor seconds of a process, and of its children that have ended; 0 if the process has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(int(word) for word in fields[OWN[0] : OWN[1]]) / os.sysconf("SC_CLK_TCK")
