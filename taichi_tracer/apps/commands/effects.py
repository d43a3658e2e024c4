"""``taichi-tracer effects``: its arguments."""

from taichi_tracer.apps.grammar import Parser, later
from taichi_tracer.apps.options import add_camera_options, add_scene_options
from taichi_tracer.apps.words import PICTURE_SIZE, size

HELP = "what each effect costs, and what the scene saves without it"
run = later("effects:run")


def add_arguments(parser: Parser) -> None:
    """Add what ``effects`` takes."""
    add_scene_options(parser)
    what = "how light is sampled (default: %(default)s)"
    parser.add_argument("--estimator", default="brdf", metavar="NAME", help=what)
    parser.add_argument("--size", type=size, default=PICTURE_SIZE, metavar="WxH", help="pixels (default: %(default)s)")
    parser.add_argument("--sampler", metavar="NAME", help="where random numbers come from")
    add_camera_options(parser)
    parser.lists = ("estimators", "samplers", "cameras", "scenes")
