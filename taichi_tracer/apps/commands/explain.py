"""``taichi-tracer explain``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.settings import OF_PICTURE, OF_SCENE, add_option, add_scene
from taichi_tracer.system.argument_types import whole

HELP = "every number on the way from one pixel to its colour"
run = later("explain:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``explain`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE)
    which = parser.add_argument_group("which pixel", "one of --pixel, --worst and --non-finite")
    which.add_argument(
        "--pixel", type=whole, nargs=2, metavar=("X", "Y"), help="column from the left and row from the top, from 0"
    )
    which.add_argument(
        "--worst", action="store_true", help="the pixel with the largest standard error, and the sample that makes it"
    )
    which.add_argument("--non-finite", action="store_true", help="the first sample that is infinite or not a number")
    which.add_argument(
        "--sample",
        type=whole,
        metavar="K",
        help="which sample of it (default: 0, and with --worst the one that is farthest from the mean)",
    )
    add_option(which, "spp")
    parser.add_argument("--json", metavar="FILE", help="write all steps as JSON, too")
    parser.add_argument("--html", metavar="FILE", help="write a page with drawings, too")
