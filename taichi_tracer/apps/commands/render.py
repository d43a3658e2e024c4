"""``taichi-tracer render``: its arguments."""

from taichi_tracer.apps.grammar import Parser, add_cluster_option, here_or_on_cluster
from taichi_tracer.apps.notes import PICTURE_FOLDER
from taichi_tracer.settings import BY_BOUNCE, DISPLAY, KEEPING, OF_PICTURE, OF_SCENE, TARGET, add_scene
from taichi_tracer.system.argument_types import names, number

HELP = "write pictures of a scene"
run = here_or_on_cluster("render")


def add_arguments(parser: Parser) -> None:
    """Add what ``render`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE, DISPLAY, BY_BOUNCE, TARGET, KEEPING)
    add_cluster_option(parser, "take the samples")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="picture to write, or a folder; its ending says the format (default: the scene file's, or "
        f"{PICTURE_FOLDER}/SCENE_VIEW.png)",
    )
    parser.add_argument(
        "--aov",
        type=names,
        default=(),
        metavar="A,B",
        help="raw arrays that an .exr file has beside the picture, such as the distance: names with commas",
    )
    parser.add_argument(
        "--against",
        choices=("reference",),
        help="with --course: render every picture with the package's own methods, too, and write the difference: "
        "FILE_against_reference.png",
    )
    parser.add_argument(
        "--denoise",
        action="store_true",
        help="write what Open Image Denoise (the extra 'denoise') makes of the picture, and tell what error this has; "
        "the sampler is then niederreiter_two",
    )
    parser.add_argument(
        "--clamp",
        type=number,
        metavar="FACTOR",
        help="cut fireflies: no pixel of the file is brighter than FACTOR times the brightest of its eight neighbours; "
        "the bias that this adds is printed, and the sampler is then niederreiter_two",
    )
    parser.add_argument(
        "--profile",
        action="store_true",
        help="tell where the time goes, from the start of Python to the file, in a table",
    )
