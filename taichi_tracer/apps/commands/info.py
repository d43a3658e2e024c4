"""``taichi-tracer info``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.settings import OF_PICTURE, OF_SCENE, add_scene

HELP = "what a scene is made of, and which code a picture of it runs"
run = later("info:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``info`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE)
