"""``taichi-tracer info``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.apps.options import add_picture_options, add_scene_options

HELP = "what a scene is made of, and which code a picture of it runs"
run = later("info:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``info`` takes."""
    add_scene_options(parser)
    add_picture_options(parser)
    parser.lists = ("pictures", "scenes")
