"""``taichi-tracer check``: what of an assignment is right, and the first wrong number of what is not."""

import os
from argparse import Namespace
from pathlib import Path

from taichi_tracer.apps.grammar import Parser
from taichi_tracer.system.argument_types import whole

HELP = "check your own solution of an assignment"
PAGE = "check.html"


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
    from taichi_tracer.apps import supervised
    from taichi_tracer.teaching.telling import VARIABLE

    if os.name == "posix" and VARIABLE not in os.environ:
        given = (("--assignment", args.assignment), ("--seed", args.seed), ("--report", args.report))
        options = [word for name, value in given if value is not None for word in (name, str(value))]
        options += ["--debug"] * args.debug
        return supervised.check(args.folder, args.names, options)
    return run_here(args)


def run_here(args: Namespace) -> int:
    """The same in this process, which tells its parent what it does, or writes the page itself if it has none."""
    from taichi_tracer.apps.supervised import finished
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
