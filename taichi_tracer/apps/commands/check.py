"""Check your own solution of an assignment.

A check runs in a process of its own: a part that gives no answer, or that ends its process, loses nothing but itself.
The process sends each part to its parent, when it begins and when it is judged. The parent prints what was found. The
process ends if a part takes too long, and the parent starts another one for the parts that are left. A kernel that
never ends cannot be stopped in another way: while it runs, Python sees no signal.
"""

import contextlib
import multiprocessing
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from taichi_tracer.apps.console import Parser
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.system.argument_types import whole
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import BEGUN, CRASHED, OUT_OF_TIME, PartResult
from taichi_tracer.teaching.html_boxes import Report, lines_of

# A part may use so many seconds of the processor, and of the clock. Those of the shipped assignments compile and run in
# less than 6.
CPU_SECONDS, CLOCK_SECONDS = 20.0, 90.0
ENDLESS = "is there a loop that never ends?"
PAGE, RECORD = "check.html", "assignment.json"  # what is written, and what says to which assignment a folder belongs
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
    if not folder.exists() and Path(RECORD).is_file():  # DIR is left out
        folder, names = Path(), [args.folder, *names]
    target = Path(args.report) if args.report else folder / PAGE
    while report is None or names:
        with contextlib.closing(answers(folder, names, args.seed, args.assignment)) as found:
            title, names = next(found)
            if report is None:
                check_place(target, ending=".html")
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

    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends a kernel, too
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]  # prints of the part stand before its line

    def send(found: Any) -> None:
        """Send what was found, and allow as many seconds for what comes next."""
        sending.send(found)
        allow_seconds()

    try:
        allow_seconds()
        check_folder(*asked, send)
        sending.send(None)
    except (InputError, OSError) as error:
        sending.send(InputError(str(error)))


def allow_seconds() -> None:
    """The system ends this process after ``CPU_SECONDS`` more; on Windows, the clock of the parent does."""
    if os.name == "posix":
        from taichi_tracer.teaching.grading.worker import allow_cpu

        allow_cpu(CPU_SECONDS)


def answers(*asked: Any) -> Iterator[Any]:
    """What a process that checks some parts finds: a title and the names of the parts, then the result of each part.

    If the process gives no answer any more, the part that it has begun is the last one.

    Args:
        asked: the arguments of ``work``.

    Raises:
        InputError: the process sends one; or it has begun no part, so its files give no answer when they are read.
    """
    context = multiprocessing.get_context("spawn")
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(sending, *asked))
    process.start()
    sending.close()
    begun: PartResult | None = None
    try:
        while receiving.poll(CLOCK_SECONDS):
            found = receiving.recv()
            if isinstance(found, InputError):
                raise found
            if found is None:
                process.join(CLOCK_SECONDS)
                return
            is_begun = isinstance(found, PartResult) and found.status == BEGUN
            begun = found if is_begun else None
            if not is_begun:
                yield found
        status, reason = OUT_OF_TIME, f"no answer in {CLOCK_SECONDS:g} s: {ENDLESS}"
    except EOFError:
        status, reason = end_of(process)
    finally:
        process.kill()
        process.join()
    if begun is None:
        raise InputError(f"check: the files cannot be read: {reason}")
    place = f"{begun.file}:{begun.line}: " if begun.line else ""
    yield replace(begun, status=status, message=f"{place}{reason}")


def end_of(process: Any) -> tuple[str, str]:
    """The status of a part whose process has ended, and the reason."""
    process.join()
    code = process.exitcode
    how = next((one.name for one in signal.Signals if one == -code), f"exit code {code}")
    if how == "SIGXCPU":
        return OUT_OF_TIME, f"no answer in {CPU_SECONDS:g} s of the processor: {ENDLESS}"
    return CRASHED, f"the process ended ({how}): does each path return what the caller needs?"
