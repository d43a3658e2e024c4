"""``taichi-tracer effects``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.settings import CAMERA, OF_SCENE, PICTURE_SIZE, add_option, add_options, add_scene
from taichi_tracer.system.argument_types import size

HELP = "what is compiled for a scene, why, and what the rest would cost"
run = later("info:run_effects")


def add_arguments(parser: Parser) -> None:
    """Add what ``effects`` takes."""
    add_scene(parser, *OF_SCENE)
    what = "how light is sampled (default: %(default)s)"
    parser.add_argument("--estimator", dest="view", default="brdf", metavar="NAME", help=what)
    parser.add_argument("--size", type=size, default=PICTURE_SIZE, metavar="WxH", help="pixels (default: %(default)s)")
    add_option(parser, "sampler")
    add_options(parser, CAMERA)
