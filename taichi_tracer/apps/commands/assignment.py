"""Hand out an assignment of the teaching kit."""

from argparse import Namespace

from taichi_tracer.apps.console import Parser, add_command
from taichi_tracer.system.argument_types import whole


def add_arguments(parser: Parser) -> None:
    """Add what ``assignment list`` and ``assignment new`` take."""
    kinds = parser.add_subparsers(title="what", required=True, metavar="list|new", parser_class=Parser)
    add_command(kinds, "list", "list the assignments that come with the package")
    new = add_command(kinds, "new", "write the folder that a student gets")
    new.set_defaults(command=write)
    new.add_argument("assignment", metavar="NAME|FOLDER", help="a1 to a4, rt3, rt3_lights, or your own folder")
    new.add_argument("folder", metavar="DIR", help="folder to write; it must be empty or not exist")
    new.add_argument("--solution", action="store_true", help="write the solved one, for teachers")
    form = new.add_mutually_exclusive_group()
    form.add_argument("--notebook", action="store_true", help="write one notebook instead of Python files")
    form.add_argument("--nbgrader", action="store_true", help="write the teacher's notebook for nbgrader")
    form.add_argument("--otter", action="store_true", help="write the teacher's notebook for otter-grader")
    new.add_argument("--seed", type=whole, default=0, metavar="N", help="of the inputs of the checks (default: 0)")


def run(args: Namespace) -> int:
    """Print every assignment that comes with the package."""
    from taichi_tracer.teaching import catalogue

    for name in catalogue.names():
        assignment = catalogue.load(name)
        print(f"{name:<12}{assignment.title}  ({len(assignment.parts)} parts, {assignment.points:g} points)")
    return 0


def write(args: Namespace) -> int:
    """Write a student's folder, or notebook."""
    from taichi_tracer.teaching import catalogue
    from taichi_tracer.teaching.handout.export import write_folder, write_notebook

    assignment = catalogue.load(args.assignment)
    if args.notebook or args.nbgrader or args.otter:
        grader = "nbgrader" if args.nbgrader else "otter" if args.otter else ""
        written = write_notebook(assignment, args.folder, args.solution, args.seed, grader)
    else:
        written = write_folder(assignment, args.folder, args.solution, args.seed)
    for path in written:
        print(path)
    return 0
