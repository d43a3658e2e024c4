"""``taichi-tracer view``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.settings import DISPLAY, OF_PICTURE, OF_SCENE, add_scene
from taichi_tracer.system.argument_types import whole

HELP = "open the interactive window"
run = later("viewer:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``view`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE, DISPLAY)
    parser.add_argument("--browser", action="store_true", help="serve the picture to a browser on this machine instead")
    parser.add_argument(
        "--forwarded",
        type=whole,
        action="append",
        default=[],
        metavar="PORT",
        help="with --browser: a port of another machine that leads here, if its number is another one",
    )
