"""The command line: what can be typed, and how errors are told. Each command lives in a module of its own.

Nothing here imports Taichi: ``--help`` and ``--version`` answer at once, and a command loads what it needs.
"""

import argparse
import os
import sys
import warnings
from collections.abc import Callable

import taichi_tracer
from taichi_tracer.system.errors import InputError, StaleSceneError

USER_ERROR, INTERRUPTED = 2, 130  # exit codes
MOST_PIXELS = 8192**2  # their fields take 3 GB


def main(argv: list[str] | None = None) -> int:
    """Run one command; returns the exit code: 0, 2 when the input cannot be used, 130 when Ctrl-C was pressed.

    Args:
        argv: the words after the program's name; those of this process when None.
    """
    warnings.showwarning = show_warning
    words = [as_value(word) for word in (sys.argv[1:] if argv is None else argv)]
    try:
        args = make_parser().parse_args(words)
        return args.command(args)
    except (InputError, StaleSceneError, OSError) as error:
        if isinstance(error, BrokenPipeError):  # the reader of our output has gone, as in "... | head"
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0
        if "--debug" in words:
            raise
        print(f"taichi-tracer: error: {' '.join(str(error).split())}", file=sys.stderr)
        return USER_ERROR
    except KeyboardInterrupt:
        print("taichi-tracer: interrupted", file=sys.stderr)
        return INTERRUPTED


def show_warning(message, category, *_where, **_more) -> None:
    """What the library warns of, as a line of ours; what other libraries warn of is not the user's to mend."""
    if issubclass(category, UserWarning):
        print(f"taichi-tracer: note: {message}", file=sys.stderr)


def as_value(word: str) -> str:
    """``word``, marked with a space when it is a negative number: argparse would take -1e-3 for an option."""
    try:
        float(word)
    except ValueError:
        return word
    return f" {word}" if word.startswith("-") else word


class Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are ours, and whose help may end with names that cost time to find."""

    names: Callable[[], str] | None = None

    def error(self, message: str) -> None:
        """Raise instead of printing the whole usage."""
        raise InputError(f"{message} (see: {self.prog} --help)")

    def format_help(self) -> str:
        """The help, and the names that ``names`` finds now."""
        return super().format_help() + ("" if self.names is None else self.names())


def make_parser() -> Parser:
    """The whole grammar of the command line."""
    parser = Parser(prog="taichi-tracer", description="A teaching ray tracer: pictures, and questions to a scene.")
    parser.add_argument("--version", action="version", version=f"taichi-tracer {taichi_tracer.__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=Parser)

    render = add_command(commands, "render", "write pictures of a scene", "render:run")
    add_scene_options(render)
    add_picture_options(render)
    targets = render.add_argument_group(
        "when to stop", "at the first that is reached; else the samples of the scene file, or 1"
    )
    targets.add_argument("--spp", type=at_least_one, metavar="N", help="samples per pixel")
    targets.add_argument("--time", type=positive, metavar="SECONDS", help="seconds of rendering, without compiling")
    targets.add_argument("--error", type=positive, metavar="PERCENT", help="estimated relative RMSE of the picture")
    targets.add_argument("--adaptive", action="store_true", help="more samples where the error is larger")
    keeping = render.add_argument_group("stopping and going on")
    keeping.add_argument("--checkpoint", metavar="FILE", help="keep the samples there, and go on from it if it exists")
    keeping.add_argument(
        "--checkpoint-every", type=positive, default=30, metavar="SECONDS", help="how often (default: 30)"
    )
    keeping.add_argument(
        "--first-sample",
        type=whole,
        default=0,
        metavar="K",
        help="index of the first sample, to render parts elsewhere",
    )
    render.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="picture to write, or a folder; its ending says the format (default: the scene file's, or "
        "renders/SCENE_VIEW.png)",
    )

    merge = add_command(commands, "merge", "add the samples of two checkpoints of one picture", "merge:run")
    merge.add_argument("first", metavar="A", help="checkpoint")
    merge.add_argument("second", metavar="B", help="checkpoint with other samples of the same picture")
    merge.add_argument("-o", "--output", metavar="C", required=True, help="checkpoint, or picture, to write")

    view = add_command(commands, "view", "open the interactive window", "viewer:run")
    add_scene_options(view)
    add_picture_options(view)

    export = add_command(commands, "export", "write a scene and its camera as RT3 XML", "export:run")
    add_scene_argument(export)
    export.add_argument("output", metavar="OUT.xml", help="file to write; the meshes stand in it, number by number")
    add_picture_options(export)

    info = add_command(commands, "info", "what a scene is made of", "info:run")
    add_scene_options(info)

    effects = add_command(
        commands, "effects", "what each effect costs, and what the scene saves without it", "effects:run"
    )
    add_scene_options(effects)
    effects.add_argument("--estimator", default="brdf", metavar="NAME", help="how light is sampled (default: brdf)")
    effects.add_argument("--size", type=size, default=(512, 512), metavar="WxH", help="pixels (default: 512x512)")

    add_accuracy(add_command(commands, "accuracy", "what accuracy costs in time", "accuracy:run"))

    compare = add_command(commands, "compare", "how different two pictures are", "compare:run")
    compare.add_argument("first", metavar="A", help="picture: .exr .hdr .pfm .npy .png .jpg")
    compare.add_argument("second", metavar="B", help="picture of the same size, by which A is measured")
    compare.add_argument("--report", metavar="FILE", help="page to write, .html, with both and where they differ")
    compare.add_argument("--tolerance", type=positive, metavar="PERCENT", help="exit with 1 if they differ by more")
    compare.add_argument("--data", action="store_true", help="PNG and JPEG hold data, such as normals: not sRGB")

    hard = add_command(
        commands, "hardcases", "do hard cases stay numerically stable, and what does that cost", "hardcases:run"
    )
    size_of = hard.add_mutually_exclusive_group()
    hard.set_defaults(level="default")
    for name, what in (("quick", "within a minute"), ("full", "for an hour, with 1e8 rays at edges for every mode")):
        size_of.add_argument(f"--{name}", dest="level", action="store_const", const=name, help=what)
    hard.add_argument("--json", metavar="FILE", help="write what was found as JSON, too")
    hard.add_argument(
        "--report", metavar="DIR", help="write a page with tables, charts and leak maps into a folder, too"
    )

    add_command(commands, "doctor", "what works on this machine, and what would mend the rest", "doctor:run")
    return parser


def add_accuracy(parser: Parser) -> None:
    """What a study of accuracy compares, and for how long."""
    parser.names = lambda: load("choices:help_text")()
    parser.add_argument("scene", metavar="SCENE", help="name of a shipped scene, or a file")
    parser.add_argument("--environment", metavar="E", help="a shipped name or an image (default: studio)")
    parser.add_argument("--intensity", type=number, metavar="X", help="factor of its radiance (default: 1)")
    parser.add_argument("--rotation", type=number, metavar="D", help="turn it about +y by degrees")
    for name, default in (
        ("estimators", "uniform,brdf,environment,mis"),
        ("samplers", "sobol,independent"),
        ("precisions", "f32,f64"),
        ("triangle-tests", "watertight,moller_trumbore"),
        ("lookups", "nearest,bilinear"),
    ):
        parser.add_argument(f"--{name}", metavar="A,B", help=f"what to compare, or all (default: {default})")
    parser.add_argument("--fast-math", choices=("off", "on", "both"), default="both", help="default: both")
    parser.add_argument("--every", action="store_true", help="every combination, not each knob alone")
    parser.add_argument("--size", type=size, default=(128, 128), metavar="WxH", help="pixels (default: 128x128)")
    parser.add_argument("--seeds", type=at_least_one, default=3, metavar="N", help="renderings of each (default: 3)")
    parser.add_argument("--budget", type=positive, default=60, metavar="SECONDS", help="in all (default: 60)")
    parser.add_argument("--report", metavar="DIR", help="folder for a page, a chart, CSV and JSON")
    parser.add_argument("--arch", default="auto", help="auto, cpu, cuda, metal or vulkan (default: auto)")


def add_command(commands: argparse._SubParsersAction, name: str, what: str, target: str) -> Parser:
    """A command that runs ``module:function`` of this folder with the parsed arguments."""
    parser = commands.add_parser(name, help=what, description=what[0].upper() + what[1:] + ".")
    parser.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help="show the traceback of errors")
    parser.set_defaults(command=lambda args: load(target)(args))
    return parser


def load(target: str) -> Callable:
    """The function that "module:function" names, its module imported only now."""
    import importlib

    module, function = target.split(":")
    return getattr(importlib.import_module(f"taichi_tracer.apps.{module}"), function)


def add_scene_options(parser: Parser) -> None:
    """The scene, how its rays are intersected, and where that runs."""
    add_scene_argument(parser)
    light = parser.add_argument_group("light from far away")
    light.add_argument(
        "--environment",
        metavar="E",
        help="a shipped name, an image (.hdr .exr .png .jpg .npy), or none (default: the scene file's, or studio where "
        "light is asked for)",
    )
    light.add_argument(
        "--intensity", type=number, metavar="X", help="factor of the environment's radiance (default: 1)"
    )
    light.add_argument("--rotation", type=number, metavar="D", help="turn the environment about +y by degrees")
    light.add_argument("--lookup", metavar="NAME", help="nearest texel, or bilinear (default: nearest)")
    light.add_argument("--effects", metavar="scene|all", help="compile what the scene calls for, or everything")
    rays = parser.add_argument_group("how rays are intersected")
    rays.add_argument("--intersector", metavar="NAME", help="acceleration structure (default: bvh)")
    rays.add_argument("--triangle-test", metavar="NAME", help="ray-triangle test (default: watertight)")
    machine = parser.add_argument_group("where it runs")
    machine.add_argument("--arch", default="auto", help="auto, cpu, cuda, metal or vulkan (default: auto)")
    machine.add_argument("--precision", default="f32", help="f32 or f64 (default: f32)")
    machine.add_argument("--fast-math", action="store_true", help="let the compiler round and treat NaN freely")


def add_scene_argument(parser: Parser) -> None:
    """The scene alone."""
    parser.names = lambda: load("choices:help_text")()
    what = "name of a shipped scene, or a file: .obj .ply .stl .glb ..., or .xml of RT3"
    parser.add_argument("scene", metavar="SCENE", help=what)


def add_picture_options(parser: Parser) -> None:
    """What is shown, how large, and from where."""
    parser.add_argument(
        "--view",
        "--estimator",
        dest="view",
        metavar="NAME",
        help="what to show, or how to sample its light: one name, several with commas, or 'all' (default: the scene "
        "file's, or normal)",
    )
    parser.add_argument("--size", type=size, metavar="WxH", help="pixels (default: the scene file's, or 512x512)")
    parser.add_argument("--quick", action="store_true", help="a quarter of the width and of the height")
    parser.add_argument(
        "--crop",
        type=number,
        nargs=4,
        metavar=("X0", "X1", "Y0", "Y1"),
        help="render only this part of the frame, in fractions of it, y from the bottom",
    )
    parser.add_argument("--sampler", metavar="NAME", help="random numbers: sobol or independent (default: sobol)")
    parser.add_argument("--seed", type=whole, default=0, metavar="S", help="of the random numbers (default: 0)")
    parser.add_argument("--jitter", action="store_true", help="rays through random points of the pixels, in views too")
    camera = parser.add_argument_group("camera", "what is not given is the scene's own")
    for name, what in (("eye", "position"), ("at", "point looked at"), ("up", "which way is up")):
        camera.add_argument(f"--{name}", type=number, nargs=3, metavar=("X", "Y", "Z"), help=what)
    camera.add_argument("--camera", metavar="NAME", help="perspective or orthographic (default: perspective)")
    camera.add_argument(
        "--window",
        type=number,
        nargs=4,
        metavar=("L", "R", "B", "T"),
        help="left, right, bottom and top of the image plane: at distance 1, or in world units where orthographic",
    )
    camera.add_argument("--fov", type=number, metavar="D", help="vertical field of view in degrees, between 0 and 180")
    camera.add_argument(
        "--handedness",
        metavar="left|right",
        help="left mirrors, as the course does; right shows the scene as a modelling program does (default: left)",
    )


def number(text: str) -> float:
    """A number, for argparse."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None


def positive(text: str) -> float:
    """A number more than 0, for argparse."""
    value = number(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text.strip()!r} is not a number more than 0")
    return value


def at_least_one(text: str) -> int:
    """A whole number of at least 1, for argparse."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text.strip()!r} is not a whole number of at least 1")
    return value


def whole(text: str) -> int:
    """A whole number of at least 0, for argparse."""
    try:
        value = int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text.strip()!r} is not a whole number of at least 0")
    return value


def size(text: str) -> tuple[int, int]:
    """Width and height from "640x480", for argparse; "512" is a square."""
    parts = text.lower().replace("×", "x").split("x")
    if len(parts) == 1:
        parts *= 2
    try:
        width, height = (int(part) for part in parts)
    except ValueError:
        width = height = 0
    if width < 1 or height < 1:
        raise argparse.ArgumentTypeError(
            f"{text.strip()!r} is not WIDTHxHEIGHT, two whole numbers of at least 1, such as 640x480"
        )
    if width * height > MOST_PIXELS:
        raise argparse.ArgumentTypeError(f"{text.strip()!r} has more than {MOST_PIXELS:,} pixels")
    return width, height
