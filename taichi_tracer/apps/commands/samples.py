"""Where samples of the light go."""

from argparse import Namespace
from pathlib import Path

import numpy as np

from taichi_tracer.apps.console import PICTURE_FOLDER, Parser
from taichi_tracer.apps.running import written_bytes
from taichi_tracer.environment import load_environment
from taichi_tracer.files.disk import make_folder, shipped_environments
from taichi_tracer.scene_data_loader import find_scene, load_scene_data, scene_names
from taichi_tracer.settings import ADVICE, add_options
from taichi_tracer.studies import samples
from taichi_tracer.system.argument_types import at_least_one, number, size, whole
from taichi_tracer.system.errors import InputError, digits_of, one_of

IMAGES = (".hdr", ".exr", ".pfm", ".npy", ".png", ".jpg", ".jpeg")
TOP = 5  # lamps of each choice in the table


def names_environment(what: str) -> bool:
    """Whether a word leads to an environment; if not, it leads to a scene.

    Raises:
        InputError: it leads to neither.
    """
    if what in shipped_environments() or Path(what).suffix.lower() in IMAGES:
        return True
    if what not in scene_names() and Path(what).suffix == "":
        known = [*shipped_environments(), *scene_names(), "or the path of an image or a scene"]
        raise one_of("environment or scene", what, known)
    find_scene(what)
    return False


def add_arguments(parser: Parser) -> None:
    """Add what ``samples`` takes."""
    parser.add_argument(
        "what",
        metavar="ENVIRONMENT|SCENE",
        help="an environment: uniform directions against importance sampling; or a scene with lamps: which of them are "
        "chosen from a point",
    )
    add_options(parser, ADVICE)
    parser.add_argument(
        "--count", type=at_least_one, default=1_000_000, metavar="N", help="samples of each (default: %(default)s)"
    )
    parser.add_argument(
        "--size", type=size, default="256x128", metavar="WxH", help="cells of the maps (default: %(default)s)"
    )
    parser.add_argument("--seed", type=whole, default=0, metavar="S", help="of the random numbers (default: 0)")
    parser.add_argument(
        "--point", type=number, nargs=3, metavar=("X", "Y", "Z"), help="that is lit (default: the middle of the view)"
    )
    parser.add_argument(
        "--normal", type=number, nargs=3, metavar=("X", "Y", "Z"), help="there (default: that of the surface, or up)"
    )
    parser.add_argument(
        "-o", "--output", default=PICTURE_FOLDER, metavar="DIR", help="folder for the pictures (default: %(default)s)"
    )


def run(args: Namespace) -> int:
    """Take the samples, print the tables, and write the pictures."""
    is_environment, of = names_environment(args.what), Path(args.what).stem
    if is_environment and (args.point or args.normal):
        raise InputError(f"--point and --normal belong to a scene: {args.what} is an environment, the same everywhere")
    if args.normal is not None and not np.any(args.normal):
        raise InputError("--normal must not be 0 0 0")
    make_folder(args.output, f"--output {args.output}")
    lines, found = of_environment(args) if is_environment else of_scene(args)
    print("\n".join(lines))
    brightest = max(one.cells.max() for one in found)  # of all maps, which have the same scale
    for one in found:
        content = samples.map_png(one, int(brightest), f"{of}: {one.total:,} samples, {one.name}")
        print(f"wrote {written_bytes(Path(args.output, f'samples_{of}_{one.name}.png'), content)}")
    return 0


def of_environment(args: Namespace) -> tuple[list[str], list[samples.Counts]]:
    """(lines of text, where the samples went) for an environment."""
    environment = load_environment(args.what)
    found = samples.environment_counts(environment, args.count, args.size, args.seed)
    title = f"{Path(args.what).stem}, {environment.width}x{environment.height}"
    lines = [f"{title}: {args.count:,} samples, counted in {args.size[0]}x{args.size[1]} cells", ""]
    lines += samples.map_table(found)
    return lines, found


def of_scene(args: Namespace) -> tuple[list[str], list[samples.Counts]]:
    """(lines of text, where the samples went) for the lamps of a scene."""
    scene = load_scene_data(args.what)
    point, normal = samples.lit_point(scene, args.point)
    if args.normal is not None:
        normal = np.asarray(args.normal) / np.linalg.norm(args.normal)
    found = samples.lamp_counts(scene, point, normal, args.count, args.size, args.seed)
    where = f"from {digits_of(np.round(point, 4))} with the normal {digits_of(np.round(normal, 4))}"
    lines = [f"{Path(args.what).stem}, {scene.lamps.count:,} lamps: {args.count:,} samples {where}", ""]
    lines += [*samples.choice_table(found), "", *samples.top_table(found, scene, TOP), ""]
    lines += [
        "effective: as many lamps with equal shares have the same entropy.",
        "deviation: of one sample of the light that arrives if nothing blocks it, relative to the mean.",
    ]
    return lines, found
