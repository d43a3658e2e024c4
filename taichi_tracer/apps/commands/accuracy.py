"""What accuracy costs in time."""

import html
import math
from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.apps.console import Parser
from taichi_tracer.apps.pictures import camera_for, check
from taichi_tracer.apps.running import Interruption, written_bytes
from taichi_tracer.files import page
from taichi_tracer.files.disk import check_place, make_folder, replace_file
from taichi_tracer.picture.error_estimate import percent
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
from taichi_tracer.studies import accuracy_report, agreement, variants
from taichi_tracer.studies.agreement import FALSE_ALARMS, Compared, Group
from taichi_tracer.studies.study import Measurement
from taichi_tracer.studies.variants import Bench
from taichi_tracer.system import runtime
from taichi_tracer.system.argument_types import at_least_one, names, positive, size, whole, wholes

NAME = "agreement.html"
MARKED = 3.0  # |z| of a block that is named
LEGEND = (
    "Each square is a block of pixels. Blue blocks are darker than those of the estimator that all are compared with, "
    f"red ones brighter; the colour is full where the difference is {MARKED:g} times its standard error. Noise has "
    "both colours without an order; a bias has one."
)
SHOWN = 320  # pixels: the width of a map
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
        with study_bar() as bar:
            return check_agreement(args, partial(show, bar))
    plan, report = plan_of(args), report_of(args)
    with Interruption() as interruption, study_bar() as bar:
        study = Measurement(
            bench_of(args),
            plan,
            args.budget,
            args.seeds,
            started=args.started,
            tell=partial(show, bar),
            should_stop=lambda: interruption.number is not None,
        ).run()
        print("\n".join(accuracy_report.as_text(study)))
        if report is not None:
            for name, content in accuracy_report.contents(study).items():
                print(written_bytes(report / name, content))
    return 0 if interruption.number is None else interruption.exit_code


def plan_of(args: Namespace) -> list[variants.Variant]:
    """The variants that the options ask for."""
    knobs: dict[str, Any] = {name: getattr(args, name) for name in (*variants.NAMED, "max_bounces")}
    if args.roulettes is not None:
        knobs["roulettes"] = tuple(number_or_name(word) for word in args.roulettes)
    knobs |= {"rr_start_bounce": args.rr_start_bounce, "fast_math": FAST_MATH.get(args.fast_math)}
    return variants.plan(**{name: knob for name, knob in knobs.items() if knob is not None})


def settings_of(args: Namespace) -> RenderSettings:
    """The settings of the scene and the camera; what is compared belongs to the plan."""
    compared = {"max_bounces": None, "rr_start_bounce": None, "fast_math": False}
    return RenderSettings.of(Namespace(**vars(args) | compared))


def bench_of(args: Namespace) -> Bench:
    """What renders the scenes of the study."""
    settings, (width, height) = settings_of(args), args.size
    check(settings)
    return Bench(
        args.scene,
        args.environment,
        args.size,
        parts=tuple(args.parts),
        of_scene=settings.given("brdfs", "lights", "up_axis", "two_sided_lamps"),
        view_of=partial(camera_for, settings, aspect=width / height),
        **settings.given("arch", "intensity", "rotation"),
    )


def number_or_name(word: str) -> str | float:
    """The number that a word is; else the word, which is a name."""
    try:
        return float(word)
    except ValueError:
        return word


def report_of(args: Namespace) -> Path | None:
    """The report's folder, made, and its files known to be writable; None if no report is wanted."""
    if args.report is None:
        return None
    folder = Path(args.report)
    make_folder(folder, f"--report {args.report}")
    for name in accuracy_report.FILES:
        check_place(folder / name)
    return folder


def study_bar():
    """A progress bar of the budget on stderr, when that is a terminal."""
    from tqdm import tqdm

    return tqdm(total=1.0, bar_format="{percentage:3.0f}%|{bar}| {desc}", leave=False, disable=None)


def show(bar, what: str, done: float) -> None:
    """Bring a bar up to date: what is done now, and the share of the work that is done."""
    bar.set_description_str(what, refresh=False)
    bar.update(max(0.0, min(done, 1.0) - bar.n))
    bar.refresh()


# ── do the estimators agree? ──


def check_agreement(args: Namespace, tell: Callable[[str, float], Any]) -> int:
    """Render, and say which estimators differ; 1 if some do.

    Args:
        tell: is called with what is rendered, and the share of the work that is done.
    """
    if args.arch is None:
        runtime.ensure()
    else:
        runtime.init(args.arch)
    if args.report is not None:
        make_folder(Path(args.report), f"--report {args.report}")
    estimators = None if args.estimators == variants.ALL else args.estimators
    scene = bench_of(args).load(variants.Variant())
    groups = agreement.agreement(scene, args.size, args.budget, estimators, tell=tell)
    print("\n".join(line for group in groups for line in lines_of(group)))
    print(f"If nothing is biased, {FALSE_ALARMS:.0%} of such checks tell a difference by chance.")
    if args.report is not None:
        path = Path(args.report) / NAME
        replace_file(path, as_page(str(args.scene), groups).encode())
        print(path)
    return 0 if all(group.agrees for group in groups) else 1


def lines_of(group: Group) -> list[str]:
    """What was found of estimators that should agree."""
    head = f"{group.what}: compared with {group.reference}, whose error is {percent(group.of_reference)}"
    return [head, *(f"  {line_of(one)}" for one in group.others)]


def line_of(one: Compared) -> str:
    """What was found of one estimator."""
    shift = f"{one.name:<14} {100 * one.shift:+.2f} % ± {100 * one.error:.2f} %"
    if math.isnan(one.z):
        return f"{one.name:<14} unknown: its samples are too few or its noise is too large"
    if one.agrees:
        rest = f"; light that no sample met may hide {percent(one.unseen)}" if one.unseen > abs(one.error) / 2 else ""
        return f"{shift}  agrees{rest}"
    word = "bright" if one.z > 0 else "dark"
    count = int((np.sign(one.z) * one.blocks > MARKED).sum())
    where = f", above all in {count} of {one.blocks.size} blocks" if count else ""
    return f"{shift}  differs: too {word} (z {one.z:.1f}){where}"


def as_page(title: str, groups: list[Group]) -> str:
    """The same as a page, with a map of z for each estimator."""
    from matplotlib import colormaps

    colours = colormaps["coolwarm"]  # from 0, blue, over 0.5, grey, to 1, red
    parts: list[Any] = [page.paragraph(LEGEND, "note")]
    for group in groups:
        parts.append(f"<h2>{html.escape(lines_of(group)[0])}</h2>")
        parts += [
            page.picture(colours((one.blocks / MARKED + 1) / 2)[..., :3], line_of(one), SHOWN) for one in group.others
        ]
    return page.page(f"Do the estimators of {title} agree?", parts)
