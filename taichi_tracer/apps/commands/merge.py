"""``taichi-tracer merge``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.settings import ADVICE, DISPLAY, add_options

HELP = "add the samples of several checkpoints of one picture"
run = later("merge:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``merge`` takes."""
    parser.add_argument("files", metavar="FILE", nargs="+", help="checkpoints with other samples of the same picture")
    parser.add_argument("-o", "--output", metavar="C", required=True, help="checkpoint, or picture, to write")
    add_options(parser, ADVICE, DISPLAY)
