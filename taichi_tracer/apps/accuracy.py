"""``taichi-tracer accuracy``: what accuracy costs in time, as a table, a chart and a page."""

from argparse import Namespace
from pathlib import Path

from taichi_tracer.files.disk import check_place, make_folder
from taichi_tracer.scene_data_loader import find_scene
from taichi_tracer.studies import accuracy_report, accuracy_tables, convergence, variants


def run(args: Namespace) -> int:
    """Measure, print, and write the report if one is wanted."""
    find_scene(args.scene)
    knobs = {
        "estimators": names(args.estimators, variants.known("estimator")),
        "samplers": names(args.samplers, variants.known("sampler")),
        "precisions": names(args.precisions, variants.known("precision")),
        "triangle_tests": names(args.triangle_tests, variants.known("triangle_test")),
        "lookups": names(args.lookups, variants.known("lookup")),
    }
    knobs["fast_math"] = {"off": (False,), "on": (True,), "both": (False, True)}[args.fast_math]
    knobs = {name: value for name, value in knobs.items() if value is not None}
    plan = variants.plan(every=args.every, **knobs)
    folder = None if args.report is None else prepared(args.report)
    options = {"intensity": args.intensity, "rotation": args.rotation}
    source = variants.Source(
        args.scene, args.environment, **{name: value for name, value in options.items() if value is not None}
    )
    with Bar(args.budget) as bar:
        study = convergence.measure(source, plan, args.size, args.budget, args.seeds, args.arch, bar.show)
    print("\n".join(as_text(study)))
    if folder is not None:
        for path in accuracy_report.write(study, folder):
            print(path)
    return 0


def names(text: str | None, known: tuple[str, ...]) -> tuple[str, ...] | None:
    """A comma-separated list; "all" is every known name."""
    if text is None:
        return None
    return known if text == "all" else tuple(text.split(","))


def prepared(report: str) -> Path:
    """The report's folder, made, and its files known to be writable."""
    folder = Path(report)
    make_folder(folder, f"--report {report}")
    for name in accuracy_report.FILES:
        check_place(folder / name)
    return folder


def as_text(study: convergence.Study) -> list[str]:
    """The tables, for a terminal."""
    rows = accuracy_tables.efficiency_table(study)
    width = max(len(row["variant"]) for row in rows)
    lines = [
        f"{study.scene}, {study.size[0]}x{study.size[1]}, {study.seeds} seeds, {study.machine}; "
        f"reference: {study.reference_samples} spp, error {study.reference_error}",
        "",
        f"{'seconds of rendering to':<{width}}  " + "".join(f"{t:>14.0%}" for t in convergence.TARGETS)
        + "   ms/sample   slope  compile s  bias z",
    ]  # fmt: skip
    for curve, row in zip(study.curves, rows, strict=True):
        times = "".join(f"{accuracy_tables.show_seconds(curve.seconds_to(t)):>14}" for t in convergence.TARGETS)
        lines.append(
            f"{row['variant']:<{width}}  {times}  {row['ms per sample']:10.2f}  {row['slope']:6.2f}"
            f"  {row['compile s']:9.2f}  {row['bias z']:6.2f}"
        )
    lines += ["", *accuracy_tables.summary(study)]
    return lines


class Bar:
    """A progress bar of the budget on stderr, when that is a terminal."""

    def __init__(self, budget: float) -> None:
        from tqdm import tqdm

        layout = "{percentage:3.0f}%|{bar}| {elapsed} of " + f"{budget:g} s {{desc}}"
        self.bar = tqdm(total=1.0, bar_format=layout, leave=False, disable=None)

    def __enter__(self):
        return self

    def show(self, what: str, done: float) -> None:
        """Bring the bar up to date."""
        self.bar.set_description_str(what, refresh=False)
        self.bar.update(max(0.0, min(done, 1.0) - self.bar.n))
        self.bar.refresh()

    def __exit__(self, *_error) -> None:
        self.bar.close()
