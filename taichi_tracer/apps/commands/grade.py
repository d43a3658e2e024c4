"""``taichi-tracer grade``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.system.argument_types import at_least_one, whole

HELP = "grade the submissions of an assignment"
run = later("grade:run")


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
    parser.add_argument("--anew", action="store_true", help="grade again what was graded before")
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
