"""``taichi-tracer turntable``: its arguments."""

from taichi_tracer.apps.grammar import Parser, add_cluster_option, here_or_on_cluster
from taichi_tracer.settings import DISPLAY, OF_PICTURE, OF_SCENE, TARGET, add_scene
from taichi_tracer.system.argument_types import at_least_one, number, positive

HELP = "turn the camera about the scene, into a film"
run = here_or_on_cluster("turntable")


def add_arguments(parser: Parser) -> None:
    """Add what ``turntable`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE, DISPLAY, TARGET)
    add_cluster_option(parser, "take the samples")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        default="turntable.gif",
        help="FILE.gif, FILE.mp4 (with the extra 'video'), or a folder for one picture a frame (default: %(default)s)",
    )
    parser.add_argument(
        "--frames", type=at_least_one, metavar="N", default=60, help="how many pictures (default: %(default)s)"
    )
    parser.add_argument(
        "--degrees",
        type=number,
        metavar="D",
        default=360.0,
        help="how far the camera turns about its upward direction, at the point looked at (default: %(default)g)",
    )
    parser.add_argument(
        "--fps", type=positive, metavar="F", default=20.0, help="frames per second of the film (default: %(default)g)"
    )
