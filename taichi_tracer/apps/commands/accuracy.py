"""What accuracy costs in time."""

from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import Any

from tqdm import tqdm

from taichi_tracer.apps.console import Parser
from taichi_tracer.apps.pictures import camera_for, check
from taichi_tracer.apps.running import Interruption, written_bytes
from taichi_tracer.files.disk import make_folder
from taichi_tracer.scene_data_loader import find_scene
from taichi_tracer.settings import (
    ADVICE,
    CAMERA,
    FAR_LIGHT,
    SURFACES,
    RenderSettings,
    add_option,
    add_options,
    add_scene,
)
from taichi_tracer.studies import accuracy_report, variants
from taichi_tracer.studies.study import Study
from taichi_tracer.studies.variants import Bench
from taichi_tracer.system.argument_types import at_least_one, names, positive, size, whole, wholes

FAST_MATH = {"off": (False,), "on": (True,), "both": (False, True)}


def add_arguments(parser: Parser) -> None:
    """Add what ``accuracy`` takes."""
    add_scene(parser)
    add_option(parser, "up_axis")
    add_options(parser, ADVICE, FAR_LIGHT, SURFACES, leave=("lamp_choice", "lookup"))
    knobs = parser.add_argument_group(
        "what is compared",
        "values with commas, or all; with several values of one, only what is named is compared; those with a star if "
        "nothing is named",
    )
    for name in ("estimators", "samplers", "precisions", "intersectors", "triangle-tests", "lookups"):
        keyword = name.replace("-", " ")
        knobs.add_argument(f"--{name}", type=names, metavar="A,B", help=f"which {keyword}")
    knobs.add_argument("--fast-math", choices=("off", "on", "both"), help="default: both")
    knobs.add_argument("--lamp-choices", type=names, metavar="A,B", help="how a sample chooses among lamps")
    knobs.add_argument(
        "--max-bounces",
        type=wholes,
        metavar="A,B",
        help="how many surfaces may reflect on a path; the largest is that of the reference (default: 5)",
    )
    knobs.add_argument(
        "--roulettes",
        type=names,
        metavar="A,B",
        help="none, throughput, or the probability q with which the course's roulette ends a path: 0.2,0.5",
    )
    knobs.add_argument(
        "--rr-start-bounce", type=whole, metavar="N", help="after so many, it may end a path (default: 3)"
    )
    parser.add_argument("--size", type=size, default="128x128", metavar="WxH", help="pixels (default: %(default)s)")
    parser.add_argument(
        "--seeds", type=at_least_one, default=3, metavar="N", help="pictures of each (default: %(default)s)"
    )
    parser.add_argument(
        "--budget",
        type=positive,
        default=60,
        metavar="SECONDS",
        help="of measuring, after compiling (default: %(default)s)",
    )
    parser.add_argument("--report", metavar="DIR", help="folder for a page, a chart and a CSV file")
    parser.add_argument("--check", action="store_true", help="exit code 1 if a mean differs from the reference")
    parser.add_argument("--arch", metavar="NAME", help="which backend runs the kernels")
    add_options(parser, CAMERA)


def run(args: Namespace) -> int:
    """Measure, print, and write the report if one is wanted; after a signal, what was measured until then.

    Returns:
        0, or 128 and the number of the signal; with ``--check``, 1 if the mean of a variant is wrong.
    """
    find_scene(args.scene)
    plan = plan_of(args)
    if args.report is not None:
        make_folder(args.report, f"--report {args.report}")
    options = {"bar_format": "{percentage:3.0f}%|{bar}| {desc}", "leave": False, "disable": None}
    with Interruption() as interruption, tqdm(total=1.0, **options) as bar:
        study = Study(
            bench_of(args),
            plan,
            args.budget,
            args.seeds,
            started=args.started,
            tell=partial(show, bar),
            should_stop=lambda: interruption.number is not None,
        ).run()
        print("\n".join(accuracy_report.as_text(study)))
        if args.report is not None:
            for name, content in accuracy_report.contents(study).items():
                print(written_bytes(Path(args.report, name), content))
    if interruption.number is not None:
        return interruption.exit_code
    return 1 if args.check and accuracy_report.biases_of(study) else 0


def plan_of(args: Namespace) -> list[variants.Variant]:
    """The variants that the options ask for."""
    knobs: dict[str, Any] = {name: getattr(args, name) for name in (*variants.NAMED, "max_bounces")}
    if args.roulettes is not None:
        knobs["roulettes"] = tuple(number_or_name(word) for word in args.roulettes)
    knobs |= {"rr_start_bounce": args.rr_start_bounce, "fast_math": FAST_MATH.get(args.fast_math)}
    return variants.plan(**{name: knob for name, knob in knobs.items() if knob is not None})


def bench_of(args: Namespace) -> Bench:
    """What renders the scenes of the study."""
    compared = {"max_bounces": None, "rr_start_bounce": None, "fast_math": False}  # which belong to the plan
    settings = RenderSettings.of(Namespace(**vars(args) | compared))
    check(settings)
    return Bench(
        args.scene,
        args.environment,
        args.size,
        parts=tuple(args.parts),
        of_scene=settings.given("brdfs", "lights", "up_axis", "two_sided_lamps"),
        view_of=partial(camera_for, settings),
        **settings.given("arch", "intensity", "rotation"),
    )


def number_or_name(word: str) -> str | float:
    """The number that a word is; else the word, which is a name."""
    try:
        return float(word)
    except ValueError:
        return word


def show(bar, what: str, done: float) -> None:
    """Bring a bar up to date: what is done now, and the share of the work that is done."""
    bar.set_description_str(what, refresh=False)
    bar.update(max(0.0, min(done, 1.0) - bar.n))
    bar.refresh()
