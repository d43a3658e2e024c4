"""Grade the submissions of an assignment."""

import csv
import io
import json
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from taichi_tracer.apps.console import Parser, note
from taichi_tracer.files.disk import check_place, make_folder, replace_file
from taichi_tracer.system.argument_types import at_least_one, whole
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import catalogue
from taichi_tracer.teaching.base import Assignment
from taichi_tracer.teaching.grading import class_page, gradescope, submissions
from taichi_tracer.teaching.grading.grade import GradingSettings, Mark, grade_class, most_points
from taichi_tracer.teaching.grading.isolate import best_level


def add_arguments(parser: Parser) -> None:
    """Add what ``grade`` takes."""
    parser.add_argument("assignment", metavar="NAME|FOLDER", help="a1 to a4, rt3, rt3_lights, or your own folder")
    parser.add_argument(
        "path",
        metavar="SUBMISSION.zip|FOLDER",
        help="one student's zip file or folder, or a folder with one of them for each student, called <9-digit id>.zip",
    )
    parser.add_argument(
        "--jobs", type=at_least_one, default=1, metavar="N", help="submissions at the same time (default: %(default)s)"
    )
    parser.add_argument(
        "--seed", type=whole, default=1, metavar="N", help="of the inputs; keep it to yourself (default: %(default)s)"
    )
    parser.add_argument(
        "--trust",
        action="store_true",
        help="where bubblewrap does not work, grade with limits alone: only what you would run yourself",
    )
    parser.add_argument(
        "--container", default="", metavar="IMAGE", help="run each in a container of this image, by podman or docker"
    )
    written = parser.add_argument_group("what is written")
    written.add_argument("--json", action="store_true", help="print everything as JSON")
    written.add_argument("--csv", metavar="FILE", help="a table with a row for each student")
    written.add_argument("--gradescope", metavar="FILE", help="results.json of one student, for Gradescope")
    written.add_argument("--report", metavar="DIR", help="a page of the class, and one for each student")
    written.add_argument(
        "--gradescope-upload",
        dest="upload",
        action="store_true",
        help="grade nothing, but write the autograder of NAME as the second file, OUT.zip",
    )


def run(args: Namespace) -> int:
    """Grade, print a line for each submission, and write what was asked for."""
    assignment = catalogue.load(args.assignment)
    if assignment.is_sealed:
        raise InputError(f"{args.assignment}: these are a student's checks: give the assignment with its solution")
    if args.upload:
        target = gradescope.write_upload(assignment, args.assignment, Path(args.path), args.seed)
        print(target)
        return 0
    found = submissions.find(Path(args.path).expanduser(), assignment.files)
    if args.gradescope is not None and len(found) > 1:
        raise InputError(f"--gradescope writes one student's results, and {args.path} has {len(found)} submissions")
    check_place(args.csv, ending=".csv")
    check_place(args.gradescope, ending=".json")
    if args.report is not None:
        make_folder(args.report, f"--report {args.report}")
    level = best_level(args.trust, args.container)
    if level.startswith("limits"):
        note("only limits isolate the submissions: grade only what you would run yourself (docs/teaching_security.md)")
    settings = GradingSettings(level, seed=args.seed, jobs=args.jobs)
    watch = None if args.json else lambda mark: print(line_of(mark), flush=True)
    marks = grade_class(assignment, found, settings, watch)
    for place, text in ((args.gradescope, gradescope.results(marks[0])), (args.csv, as_csv(marks))):
        if place is not None:
            replace_file(place, text.encode())
    if args.report is not None:
        page = class_page.write(Path(args.report), assignment, marks, settings)
        if not args.json:
            print(page)
    print(as_json(assignment, marks, settings) if args.json else summary(marks, level))
    return 0


def line_of(mark: Mark) -> str:
    """One submission in one line."""
    head = f"{mark.student[:24]:<24} {mark.score:>6.4g} of {mark.points:<6.4g}"
    if mark.refused:
        return f"{head} refused: {mark.refused}"
    return f"{head} {mark.right} of {len(mark.parts)} parts are right, {mark.seconds:.1f} s"


def summary(marks: Sequence[Mark], level: str) -> str:
    """The last line that is printed: the mean, and the isolation."""
    mean = sum(mark.score for mark in marks) / len(marks)
    plural = "s" * (len(marks) > 1)
    return f"{len(marks)} submission{plural}, mean {mean:.4g} of {most_points(marks):g}; isolation: {level}"


def as_json(assignment: Assignment, marks: Sequence[Mark], settings: GradingSettings) -> str:
    """Everything as JSON."""
    facts = {"assignment": assignment.name, "title": assignment.title, "seed": settings.seed}
    facts |= {"level": settings.level, "submissions": [mark.facts() for mark in marks]}
    return json.dumps(facts, indent=1)


def as_csv(marks: Sequence[Mark]) -> str:
    """A table with a row for each submission. A cell that a spreadsheet would take for a formula begins with '."""
    file = io.StringIO()
    rows = csv.writer(file, lineterminator="\n")
    names = [part.name for part in marks[0].parts]
    rows.writerow(["student", "file", "score", "points", *names, "refused"])
    for mark in marks:
        cells = [mark.student, mark.key, mark.score, mark.points, *(part.earned for part in mark.parts)]
        rows.writerow([safe(cell) for cell in (*cells, mark.refused)])
    return file.getvalue()


def safe(cell: object) -> object:
    """A cell that no spreadsheet takes for a formula: its text may come from a stranger."""
    return f"'{cell}" if isinstance(cell, str) and cell[:1] in ("=", "+", "-", "@", "\t", "\r") else cell
