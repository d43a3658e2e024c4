"""``taichi-tracer merge``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.apps.options import add_display_options, add_parts_option

HELP = "add the samples of several checkpoints of one picture"
run = later("merge:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``merge`` takes."""
    parser.add_argument("files", metavar="FILE", nargs="+", help="checkpoints with other samples of the same picture")
    parser.add_argument("-o", "--output", metavar="C", required=True, help="checkpoint, or picture, to write")
    add_parts_option(parser)
    add_display_options(parser)
    parser.lists = ("samplers", "tones")
