"""What accuracy costs in time."""

from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from taichi_tracer.apps import agreement
from taichi_tracer.apps.grammar import Parser
from taichi_tracer.apps.pictures import camera_for, check
from taichi_tracer.apps.running import Interruption, written_bytes
from taichi_tracer.files.disk import check_place, make_folder
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
from taichi_tracer.studies.source import Source
from taichi_tracer.studies.study import Measurement
from taichi_tracer.system.argument_types import at_least_one, names, positive, size, whole, wholes

FAST_MATH = {"off": (False,), "on": (True,), "both": (False, True)}


@dataclass(frozen=True)
class ViewChange:
    """Where the camera is: the options of the command line, applied to the parameters of a scene's camera.

    It is a class and no function within a function, because it is sent to other processes.
    """

    settings: RenderSettings
    aspect: float

    def __call__(self, view: dict) -> dict:
        """The parameters of the camera."""
        return camera_for(self.settings, view, self.aspect)


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
    parser.add_argument(
        "--check",
        action="store_true",
        help="only say which estimators differ that should agree (exit code 1)",
    )
    parser.add_argument("--arch", metavar="NAME", help="which backend runs the kernels")
    add_options(parser, CAMERA)


def run(args: Namespace) -> int:
    """Measure, print, and write the report if one is wanted; after a signal, what was measured until then.

    Returns:
        0, or 128 and the number of the signal; with ``--check``, 1 if estimators differ.
    """
    find_scene(args.scene)
    if args.check:
        estimators = chosen_names(args.estimators, variants.known("estimators"))
        with StudyBar() as bar:
            return agreement.run(args, source_of(args), estimators, bar.show)
    plan, report = plan_of(args), report_of(args)
    with Interruption() as interruption, StudyBar() as bar:
        study = Measurement(
            source_of(args),
            plan,
            args.size,
            args.budget,
            args.seeds,
            parts=tuple(args.parts),
            started=args.started,
            tell=bar.show,
            should_stop=lambda: interruption.number is not None,
            **settings_of(args).given("arch"),
        ).run()
        print("\n".join(accuracy_report.as_text(study)))
        if report is not None:
            for name, content in accuracy_report.contents(study).items():
                print(written_bytes(report / name, content))
    return 0 if interruption.number is None else interruption.exit_code


def plan_of(args: Namespace) -> list[variants.Variant]:
    """The variants that the options ask for."""
    knobs: dict[str, Any] = {name: chosen_names(getattr(args, name), variants.known(name)) for name in variants.NAMED}
    knobs["estimators"] = estimators_of(args)
    knobs |= {"max_bounces": args.max_bounces, "roulettes": roulettes_of(args.roulettes)}
    knobs |= {"rr_start_bounce": args.rr_start_bounce, "fast_math": FAST_MATH.get(args.fast_math)}
    return variants.plan(**{name: knob for name, knob in knobs.items() if knob is not None})


def settings_of(args: Namespace) -> RenderSettings:
    """The settings of the scene and the camera; what is compared belongs to the plan."""
    compared = {"max_bounces": None, "rr_start_bounce": None, "fast_math": False}
    return RenderSettings.of(Namespace(**vars(args) | compared))


def source_of(args: Namespace) -> Source:
    """Where the scenes of the study come from."""
    settings, (width, height) = settings_of(args), args.size
    check(settings)
    return Source(
        args.scene,
        args.environment,
        settings.given("brdfs", "lights", "up_axis", "two_sided_lamps"),
        view_of=ViewChange(settings, width / height),
        **settings.given("intensity", "rotation"),
    )


def estimators_of(args: Namespace) -> tuple[str, ...] | None:
    """The estimators that were chosen; "all" is every one of direct light, or of paths where they are asked about."""
    asks_for_paths = any(getattr(args, name) is not None for name in variants.OF_PATHS)
    kinds = {
        is_path: tuple(n for n in variants.known("estimators") if variants.is_path(n) == is_path) for is_path in (0, 1)
    }
    return chosen_names(args.estimators, kinds[asks_for_paths])


def roulettes_of(chosen: tuple[str, ...] | None) -> tuple[str | float, ...] | None:
    """The roulettes that were chosen: names, and numbers q."""
    if chosen is None or chosen == ("all",):
        return chosen_names(chosen, variants.known("roulettes"))
    return tuple(number_or_name(word) for word in chosen)


def number_or_name(word: str) -> str | float:
    """The number that a word is; else the word, which is a name."""
    try:
        return float(word)
    except ValueError:
        return word


def chosen_names(chosen: tuple[str, ...] | None, known: tuple[str, ...]) -> tuple[str, ...] | None:
    """The names that were chosen; "all" is every known name."""
    return known if chosen == ("all",) else chosen


def report_of(args: Namespace) -> Path | None:
    """The report's folder, made, and its files known to be writable; None if no report is wanted."""
    if args.report is None:
        return None
    folder = Path(args.report)
    make_folder(folder, f"--report {args.report}")
    for name in accuracy_report.FILES:
        check_place(folder / name)
    return folder


class StudyBar:
    """A progress bar of the budget on stderr, when that is a terminal."""

    def __init__(self) -> None:
        from tqdm import tqdm

        self.bar = tqdm(total=1.0, bar_format="{percentage:3.0f}%|{bar}| {desc}", leave=False, disable=None)

    def __enter__(self):
        return self

    def show(self, what: str, done: float) -> None:
        """Bring the bar up to date."""
        self.bar.set_description_str(what, refresh=False)
        self.bar.update(max(0.0, min(done, 1.0) - self.bar.n))
        self.bar.refresh()

    def __exit__(self, *_error) -> None:
        self.bar.close()
