"""``taichi-tracer render``: its arguments."""

from argparse import ArgumentParser

from taichi_tracer.apps.arguments import add_cluster_option, add_display_options, add_picture_options, add_scene_options
from taichi_tracer.apps.grammar import Parser, here_or_on_cluster
from taichi_tracer.apps.words import PICTURE_FOLDER, at_least_one, bounces, names, positive, whole

HELP = "write pictures of a scene"
run = here_or_on_cluster("render")


def add_arguments(parser: Parser) -> None:
    """Add what ``render`` takes."""
    add_scene_options(parser)
    add_picture_options(parser)
    add_display_options(parser)
    parser.add_argument(
        "--bounces",
        type=bounces,
        default=(),
        metavar="LIST",
        help="one picture for the light after each of these numbers of bounces, such as 0,1,2,3+ or 0,1-4, and one "
        "with all of them side by side: FILE_bounce_0.png ..., FILE_bounces.png",
    )
    add_when_to_stop(parser)
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
        "--profile",
        action="store_true",
        help="tell where the time goes, from the start of Python to the file, in a table and in FILE.profile.html",
    )
    parser.lists = ("pictures", "tones", "aovs", "scenes")


def add_when_to_stop(parser: ArgumentParser) -> None:
    """Add when the rendering ends, and how it goes on another time."""
    targets = parser.add_argument_group(
        "when to stop", "at the first that is reached; else the samples of the scene file, or 1"
    )
    targets.add_argument("--spp", type=at_least_one, metavar="N", help="samples per pixel")
    targets.add_argument("--time", type=positive, metavar="SECONDS", help="seconds of rendering, without compiling")
    targets.add_argument("--error", type=positive, metavar="PERCENT", help="estimated relative RMSE of the picture")
    targets.add_argument("--adaptive", action="store_true", help="more samples where the error is larger")
    keeping = parser.add_argument_group("stopping and going on")
    keeping.add_argument("--checkpoint", metavar="FILE", help="keep the samples there, and go on from it if it exists")
    keeping.add_argument(
        "--checkpoint-every", type=positive, default=30, metavar="SECONDS", help="how often (default: %(default)s)"
    )
    what = "index of the first sample, to render parts elsewhere (default: %(default)s)"
    keeping.add_argument("--first-sample", type=whole, metavar="K", help=what)
