"""``taichi-tracer check``: what of an assignment is right, and the first wrong number of what is not."""

from argparse import Namespace
from pathlib import Path

from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.teaching.checking import assignment_of, check_folder

PAGE = "check.html"
NOT_RIGHT = 1  # the exit code if a part is not right


def run(args: Namespace) -> int:
    """Check a folder; print each part as soon as it is known, and write a page."""
    folder = Path(args.folder).expanduser()
    target = Path(args.report) if args.report else folder / PAGE
    assignment, _ = assignment_of(folder)
    check_place(target)
    print(assignment.title)
    report = check_folder(
        folder, args.names, args.seed, lambda lines: print(*lines, sep="\n", end="\n" * bool(lines), flush=True)
    )
    replace_file(target, report.page().encode())
    print(f"{report.summary()}\n{target}")
    return 0 if report.is_right else NOT_RIGHT
