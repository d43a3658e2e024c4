"""``taichi-tracer samples``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.apps.notes import PICTURE_FOLDER
from taichi_tracer.settings import ADVICE, add_options
from taichi_tracer.system.argument_types import at_least_one, number, size, whole

HELP = "where samples of the light go"
run = later("samples:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``samples`` takes."""
    parser.add_argument(
        "what",
        metavar="ENVIRONMENT|SCENE",
        help="an environment: uniform directions against importance sampling; or a scene with lamps: which of them are "
        "chosen from a point",
    )
    add_options(parser, ADVICE)
    parser.add_argument(
        "--count", type=at_least_one, default=1_000_000, metavar="N", help="samples of each (default: %(default)s)"
    )
    parser.add_argument(
        "--size", type=size, default="256x128", metavar="WxH", help="cells of the maps (default: %(default)s)"
    )
    parser.add_argument("--seed", type=whole, default=0, metavar="S", help="of the random numbers (default: 0)")
    parser.add_argument(
        "--point", type=number, nargs=3, metavar=("X", "Y", "Z"), help="that is lit (default: the middle of the view)"
    )
    parser.add_argument(
        "--normal", type=number, nargs=3, metavar=("X", "Y", "Z"), help="there (default: that of the surface, or up)"
    )
    parser.add_argument(
        "-o", "--output", default=PICTURE_FOLDER, metavar="DIR", help="folder for the pictures (default: %(default)s)"
    )
