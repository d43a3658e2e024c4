"""``taichi-tracer export``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.apps.options import add_parts_option, add_picture_options, add_scene_argument

HELP = "write a scene and its camera as RT3 XML"
run = later("export:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``export`` takes."""
    add_scene_argument(parser)
    parser.add_argument("output", metavar="OUT.xml", help="file to write; the meshes stand in it, number by number")
    add_parts_option(parser)
    add_picture_options(parser)
    parser.lists = ("pictures", "files")
