"""``taichi-tracer check``: what of an assignment is right, and the first wrong number of what is not."""

from argparse import Namespace
from pathlib import Path

from taichi_tracer.apps.grammar import Parser
from taichi_tracer.apps.words import whole

HELP = "check your own solution of an assignment"
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
    from taichi_tracer.files.disk import check_place, replace_file
    from taichi_tracer.teaching.checking import assignment_of, check_folder

    folder = Path(args.folder).expanduser()
    target = Path(args.report) if args.report else folder / PAGE
    assignment, _ = assignment_of(folder, args.assignment)
    check_place(target)
    print(assignment.title)

    def tell(lines: list[str]) -> None:
        print(*lines, sep="\n", end="\n" * bool(lines), flush=True)

    report = check_folder(folder, args.names, args.seed, tell, args.assignment)
    replace_file(target, report.page().encode())
    print(f"{report.summary()}\n{target}")
    return 0 if report.is_right else NOT_RIGHT
