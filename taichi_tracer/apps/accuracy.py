"""``taichi-tracer accuracy``: what accuracy costs in time, as a table, a chart and a page."""

import time
from argparse import Namespace
from dataclasses import dataclass, replace
from pathlib import Path

from taichi_tracer.apps import agreement
from taichi_tracer.apps.interruption import Interruption
from taichi_tracer.apps.requests import CameraRequest, up_axis_of
from taichi_tracer.apps.rescue import written_bytes
from taichi_tracer.apps.words import given, request_from
from taichi_tracer.files.disk import check_place, make_folder
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.scene_data_loader import find_scene
from taichi_tracer.studies import accuracy_report, accuracy_sentences, accuracy_tables, convergence, schedule, variants
from taichi_tracer.studies.source import Order, Source
from taichi_tracer.system.digits import digits

FAST_MATH = {"off": (False,), "on": (True,), "both": (False, True)}


@dataclass(frozen=True)
class ViewChange:
    """Where the camera is: the options of the command line, applied to the parameters of a scene's camera.

    It is a class and no function within a function, because it is sent to other processes.
    """

    camera: CameraRequest
    aspect: float

    def __call__(self, view: dict) -> dict:
        """The parameters of the camera."""
        return self.camera.applied_to(view, self.aspect)


def run(args: Namespace) -> int:
    """Measure, print, and write the report if one is wanted; after a signal, what was measured until then.

    Returns:
        0, or 128 and the number of the signal; with ``--check``, 1 if estimators differ.
    """
    if args.check:
        if args.helper is not None:
            args.helper.close()
        find_scene(args.scene)
        estimators = names(args.estimators, variants.known("estimators"))
        with StudyBar(args.budget, args.started) as bar:
            return agreement.run(args, source_of(args), estimators, bar.show)
    try:
        order, report = study_of(args), report_of(args)
    except Exception:
        if args.helper is not None:
            args.helper.close()
        raise
    if report is not None:
        accuracy_report.get_ready()
    with Interruption() as interruption, StudyBar(order.budget, args.started) as bar:
        study = schedule.measure(
            replace(order, spent=time.perf_counter() - args.started),
            tell=bar.show,
            first=args.helper,
            should_stop=lambda: interruption.number is not None,
        )
        print("\n".join(as_text(study)))
        if report is not None:
            bar.show("writing the report", 1.0)
            for name, content in accuracy_report.contents(study).items():
                print(written_bytes(report / name, content))
    print(f"total: {time.perf_counter() - args.started:.1f} s from the start, of a budget of {order.budget:g} s")
    return 0 if interruption.number is None else interruption.exit_code


def study_of(args: Namespace) -> Order:
    """The study that the options ask for."""
    find_scene(args.scene)
    knobs = {name: names(getattr(args, name), variants.known(name)) for name in variants.NAMED}
    knobs["estimators"] = estimators_of(args)
    knobs |= {"max_bounces": args.max_bounces, "roulettes": roulettes_of(args.roulettes)}
    knobs |= {"rr_start_bounce": args.rr_start_bounce, "fast_math": FAST_MATH.get(args.fast_math)}
    return Order(
        source_of(args),
        tuple(variants.plan(every=args.every, **given(**knobs))),
        args.size,
        args.budget,
        args.seeds,
        keep=0.0 if args.report is None else accuracy_report.WRITING,
        parts=tuple(args.parts),
        **given(arch=args.arch),
    )


def source_of(args: Namespace) -> Source:
    """Where the scenes of the study come from."""
    camera, (width, height) = request_from(CameraRequest, args), args.size
    of_scene = {"brdfs": args.brdfs, "lights": args.lights, **given(up_axis=up_axis_of(args))}
    return Source(
        args.scene,
        args.environment,
        of_scene | {"two_sided_lamps": args.two_sided_lamps},
        view_of=ViewChange(camera, width / height),
        **given(intensity=args.intensity, rotation=args.rotation),
    )


def estimators_of(args: Namespace) -> tuple[str, ...] | None:
    """The estimators that were chosen; "all" is every one of direct light, or of paths where they are asked about."""
    asks_for_paths = any(getattr(args, name) is not None for name in variants.OF_PATHS)
    kinds = {
        is_path: tuple(n for n in variants.known("estimators") if variants.is_path(n) == is_path) for is_path in (0, 1)
    }
    return names(args.estimators, kinds[asks_for_paths])


def roulettes_of(chosen: tuple[str, ...] | None) -> tuple[str | float, ...] | None:
    """The roulettes that were chosen: names, and numbers q."""
    if chosen is None or chosen == ("all",):
        return names(chosen, variants.known("roulettes"))
    return tuple(number_or_name(word) for word in chosen)


def number_or_name(word: str) -> str | float:
    """The number that a word is; else the word, which is a name."""
    try:
        return float(word)
    except ValueError:
        return word


def names(chosen: tuple[str, ...] | None, known: tuple[str, ...]) -> tuple[str, ...] | None:
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


def as_text(study: convergence.Study) -> list[str]:
    """The tables and the findings, for a terminal."""
    rows = accuracy_tables.efficiency_table(study)
    width = max(len(row["variant"]) for row in rows)
    kept = f"kernels compiled anew: {study.kernels_made}"
    lines = [
        f"{study.facts.title}, {study.size[0]}x{study.size[1]}, at least {renderings(study)}, {study.facts.machine}",
        f"reference: {study.truth.samples} spp, error {study.truth.error}; {study.start_seconds:.1f} s to "
        f"start, {study.facts.read_seconds:.1f} s to read the scene; {kept}",
        "",
        f"{'seconds of rendering to':<{width}}  " + "".join(f"{t:>10.0%}" for t in convergence.TARGETS)
        + "   best error     after   ms/sample  compile s  bias z",
    ]  # fmt: skip
    for curve, row in zip(study.curves, rows, strict=True):
        times = "".join(f"{short(curve.seconds_to(t)):>10}" for t in convergence.TARGETS)
        per_sample = f"{row['ms per sample']:.2f}" + ("~" if row["time factor"] > accuracy_tables.CERTAIN else " ")
        seconds, error = curve.best
        bias = "?" if row["bias z"] != row["bias z"] else digits(row["bias z"], "6.1f")
        lines.append(
            f"{row['variant']:<{width}}  {times}  {percent(error):>11}  {short(seconds):>8}  "
            f"{per_sample:>10}  {digits(row['compile s'], '9.2f')}  {bias:>6}"
        )
    if any(row["time factor"] > accuracy_tables.CERTAIN for row in rows):
        lines.append("~ this time is uncertain by more than half")
    for rows in accuracy_tables.questions(study).values():
        lines += ["", *columns(rows)] if rows else []
    lines += ["", *(f"- {sentence}" for sentence in accuracy_tables.summary(study))]
    return lines


def renderings(study: convergence.Study) -> str:
    """How often each variant was rendered."""
    return f"{study.seeds} rendering{'s' * (study.seeds > 1)} of each"


def short(seconds: float) -> str:
    """ "1.23 s", or a dash for an error that was not reached."""
    return "-" if seconds != seconds else f"{seconds:.3g} s"


def columns(rows: list[dict]) -> list[str]:
    """Rows of names and numbers as lines of text, with errors in percent."""
    shown = [list(rows[0]), *(list(row.values()) for row in accuracy_sentences.in_words(rows))]
    widths = [max(len(str(row[i])) for row in shown) for i in range(len(shown[0]))]
    return ["  ".join(str(value).rjust(width) for value, width in zip(row, widths, strict=True)) for row in shown]


class StudyBar:
    """A progress bar of the budget on stderr, when that is a terminal."""

    def __init__(self, budget: float, started: float) -> None:
        from tqdm import tqdm

        self.budget, self.started = budget, started
        layout = "{percentage:3.0f}%|{bar}| {desc}"
        self.bar = tqdm(total=1.0, bar_format=layout, leave=False, disable=None)

    def __enter__(self):
        return self

    def show(self, what: str, done: float) -> None:
        """Bring the bar up to date."""
        elapsed = time.perf_counter() - self.started
        self.bar.set_description_str(f"{elapsed:.0f} of {self.budget:g} s, {what}", refresh=False)
        self.bar.update(max(0.0, min(done, 1.0) - self.bar.n))
        self.bar.refresh()

    def __exit__(self, *_error) -> None:
        self.bar.close()
