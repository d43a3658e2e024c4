"""``taichi-tracer view``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.apps.options import add_display_options, add_picture_options, add_scene_options
from taichi_tracer.apps.words import whole

HELP = "open the interactive window"
run = later("viewer:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``view`` takes."""
    add_scene_options(parser)
    add_picture_options(parser)
    add_display_options(parser)
    parser.add_argument("--browser", action="store_true", help="serve the picture to a browser on this machine instead")
    parser.add_argument(
        "--forwarded",
        type=whole,
        action="append",
        default=[],
        metavar="PORT",
        help="with --browser: a port of another machine that leads here, if its number is another one",
    )
    parser.lists = ("pictures", "tones", "scenes")
