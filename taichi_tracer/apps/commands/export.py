"""``taichi-tracer export``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.settings import ADVICE, OF_PICTURE, add_option, add_options, add_scene

HELP = "write a scene and its camera as RT3 XML"
run = later("export:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``export`` takes."""
    add_scene(parser)
    add_option(parser, "up_axis")
    parser.add_argument("output", metavar="OUT.xml", help="file to write; the meshes stand in it, number by number")
    add_options(parser, ADVICE, *OF_PICTURE)
