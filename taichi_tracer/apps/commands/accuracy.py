"""``taichi-tracer accuracy``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.settings import ADVICE, CAMERA, FAR_LIGHT, SURFACES, add_option, add_options, add_scene
from taichi_tracer.system.argument_types import at_least_one, names, positive, size, whole, wholes

HELP = "what accuracy costs in time"
run = later("accuracy:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``accuracy`` takes."""
    add_scene(parser)
    add_option(parser, "up_axis")
    add_options(parser, ADVICE, FAR_LIGHT, SURFACES, leave=("lamp_choice", "lookup"))
    knobs = parser.add_argument_group(
        "what is compared",
        "values with commas, or all; with several values of one, only what is named is compared; those with a star if "
        "nothing is named",
    )
    for name in ("estimators", "samplers", "precisions", "intersectors", "triangle-tests", "lookups"):
        keyword = name.replace("-", " ")
        knobs.add_argument(f"--{name}", type=names, metavar="A,B", help=f"which {keyword}")
    knobs.add_argument("--fast-math", choices=("off", "on", "both"), help="default: both")
    knobs.add_argument("--lamp-choices", type=names, metavar="A,B", help="how a sample chooses among lamps")
    knobs.add_argument(
        "--max-bounces",
        type=wholes,
        metavar="A,B",
        help="how many surfaces may reflect on a path; the largest is that of the reference (default: 5)",
    )
    knobs.add_argument(
        "--roulettes",
        type=names,
        metavar="A,B",
        help="none, throughput, or the probability q with which the course's roulette ends a path: 0.2,0.5",
    )
    knobs.add_argument(
        "--rr-start-bounce", type=whole, metavar="N", help="after so many, it may end a path (default: 3)"
    )
    parser.add_argument("--size", type=size, default="128x128", metavar="WxH", help="pixels (default: %(default)s)")
    parser.add_argument(
        "--seeds", type=at_least_one, default=3, metavar="N", help="pictures of each (default: %(default)s)"
    )
    parser.add_argument(
        "--budget",
        type=positive,
        default=60,
        metavar="SECONDS",
        help="of measuring, after compiling (default: %(default)s)",
    )
    parser.add_argument("--report", metavar="DIR", help="folder for a page, a chart and a CSV file")
    parser.add_argument(
        "--check",
        action="store_true",
        help="only say which estimators differ that should agree (exit code 1)",
    )
    parser.add_argument("--arch", metavar="NAME", help="which backend runs the kernels")
    add_options(parser, CAMERA)
