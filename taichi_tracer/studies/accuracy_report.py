"""A study of accuracy as files: one page of HTML, a chart, and the numbers as CSV and JSON."""

import csv
import io
import json
import math
from pathlib import Path
from threading import Thread

import numpy as np

from taichi_tracer.files.disk import replace_file
from taichi_tracer.picture.error_estimate import percent as in_percent
from taichi_tracer.picture.heat import heat
from taichi_tracer.studies import page
from taichi_tracer.studies.accuracy_chart import draw, figures, plain_svg, png_of
from taichi_tracer.studies.accuracy_tables import (
    CERTAIN,
    bounce_table,
    efficiency_of,
    efficiency_table,
    knob_table,
    main_curves,
    ratio_in_words,
    show_seconds,
    summary,
)
from taichi_tracer.studies.convergence import TARGETS, Curve, Study
from taichi_tracer.system.digits import digits

FILES = ("accuracy.html", "accuracy.csv", "accuracy.json", "accuracy.svg", "accuracy.png")
WRITING, DRAWING = 1.4, 0.6  # times what a process takes to start is what all files take, or the figure alone
SHOWN = 512  # pixels, width of a picture in the page where there is room
WHITE = 0.99  # quantile of all errors that is shown as white: a few pixels would leave the rest black
STYLE = """
.findings { font-size: 1.12em; } .findings li { margin: 0.35em 0; } .findings li:first-child { font-weight: 700; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 300px), 1fr)); gap: 14px; }
.pair figure { margin: 0; width: auto !important; } .pair img { width: 100%; }
.card { margin: 0 0 1.4em; break-inside: avoid; } .card h3 { margin: 0.2em 0; font-size: 1.05em; }
.scale { display: flex; align-items: center; gap: 8px; font-size: 0.86em; max-width: 460px; margin: 0.5em 0 1em; }
.scale i { flex: 1; height: 16px; border: 1px solid var(--grid); }
.chart svg { width: 100%; } use { cursor: help; }
.narrow { display: none; } @media (max-width: 700px) { .narrow { display: block; } .broad { display: none; } }
summary { cursor: pointer; font-size: 1.1em; margin: 0.6em 0; }
"""


def get_ready() -> None:
    """Load what draws the charts, beside the measurement: that takes half a second."""

    def load() -> None:
        import matplotlib.figure  # noqa: F401

    Thread(target=load, daemon=True).start()


def contents(study: Study) -> dict[str, bytes]:
    """Name → content of ``FILES``."""
    figure = draw(study)
    made = (as_html(study), as_csv(study), as_json(study), plain_svg(figure))
    return dict(zip(FILES, [*(text.encode() for text in made), png_of(figure)], strict=True))


def write(study: Study, folder: Path) -> list[Path]:
    """Write ``FILES`` into a folder that exists; returns their paths."""
    for name, content in contents(study).items():
        replace_file(folder / name, content)
    return [folder / name for name in FILES]


def as_html(study: Study) -> str:
    """The whole page: findings first, then the charts, the tables, and the pictures."""
    charts = figures(study)
    findings = "".join(f"<li>{page.html.escape(sentence)}</li>" for sentence in summary(study))
    parts = [f"<ul class='findings'>{findings}</ul>", "<h2>Error against time</h2>", chart(charts["curves"])]
    parts.append(
        page.paragraph(
            "Lines are the mean over the random seeds, bands their spread; solid lines have the first sampler, dashed "
            "lines another one. Point at a dot for its numbers. The error is the root mean square difference of all "
            "pixels to the reference, as a fraction of its mean.",
            "note",
        )
    )
    if "knobs" in charts:
        parts += ["<h2>What each knob changes</h2>", chart(charts["knobs"])]
        parts.append(
            page.paragraph(
                f"Times those of {study.curves[0].variant.label}. Bars are 95 % intervals; what is pale is noise: it "
                "cannot be told from 1.",
                "note",
            )
        )
    parts += ["<h2>What you wait for</h2>", chart(charts["wait"]), page.paragraph(of_the_wait(study), "note")]
    for title, content in tables_of_questions(study).items():
        parts += [f"<h2>{title}</h2>", content]
    parts += pictures(study)
    parts += [
        "<h2>The numbers</h2>",
        table_of_costs(study),
        table_of_knobs(study),
        page.paragraph(about(study), "note"),
    ]
    return page.page(f"What accuracy costs in time: {study.scene}", parts, STYLE)


def chart(svg: str) -> str:
    """A drawing that is as wide as the page."""
    return f"<div class='chart'>{svg}</div>"


def of_the_wait(study: Study) -> str:
    """What the chart of waits says, and how compilation was counted."""
    kept = (
        f"Kernels that were compiled anew: {study.kernels_made}; a second run finds them, and is spared that."
        if study.kernels_made
        else "An earlier run had compiled all kernels: the first run on a machine compiles for longer."
    )
    shared = "An estimator that was compiled after another one shares with it what both need."
    return f"Compiling happens once for each picture that is rendered by a new process. {kept} {shared}"


def about(study: Study) -> str:
    """How everything was measured."""
    width, height = study.size
    text = (
        f"{width}×{height} pixels, each variant rendered with {study.seeds} random seed{'s' * (study.seeds > 1)} or "
        f"more, {study.seconds:.0f} s of a budget of {study.budget:g} "
        f"s ({study.machine}). The reference has {study.reference_samples} samples per pixel and a relative error of "
        f"{study.reference_error} itself, which was taken off; where a picture is nearly as good as the reference, its "
        "error is what it tells of itself."
    )
    if study.reference_bounces is not None:
        text += f" In the reference, light bounces at most {study.reference_bounces} times."
    return text


def table_of_costs(study: Study) -> str:
    """A table of the seconds to each error, and of the numbers that they follow from."""
    rows = []
    for curve, numbers in zip(study.curves, efficiency_table(study), strict=True):
        row = {"variant": numbers["variant"]}
        row |= {f"to {t:.0%}": show_seconds(curve.seconds_to(t)) for t in TARGETS}
        row["best error"] = f"{in_percent(curve.last[1])} after {curve.last[0]:.3g} s"
        off = " (uncertain)" if curve.time_factor > CERTAIN else ""
        row["ms per sample"] = show(numbers["ms per sample"]) + off
        for name in ("variance x time", "compile s", "bias z"):
            row[name] = show(numbers[name])
        rows.append(row)
    note = (
        "All seconds are of rendering, and were measured; nothing is extrapolated. A bias z beyond ±4 would mean that "
        "the variant or the reference is biased; “?” stands where a rare light was hardly met, so that nothing can be "
        "said."
    )
    if any(curve.is_biased for curve in study.curves):
        note += (
            " Paths with fewer bounces than the reference are biased: no further sample adds the light that they miss."
        )
    return page.table(rows, list(rows[0])) + page.paragraph(note, "note")


PERCENT = ("missing light", "standard error", "noise")  # beginnings of the columns that are shown in percent


def tables_of_questions(study: Study) -> dict[str, str]:
    """Title → table, for bounces, roulettes and choices of lamps, as far as they were compared."""
    found = {}
    if bounces := bounce_table(study):
        found["What bounces bring"] = as_table(bounces) + page.paragraph(
            "Missing light is a bias: it does not become smaller with more samples, as noise does. Both are in percent "
            "of the mean of the reference. Time is a multiple of that of the most bounces.",
            "note",
        )
    titles = {"roulette": "What roulette saves", "lamp_choice": "Which lamp?"}
    for knob, title in titles.items():
        if rows := efficiency_of(study, knob):
            found[title] = as_table(rows) + page.paragraph(
                "Time and variance, at equal samples, are multiples of those of the first row. Efficiency is "
                "1/(variance × time): what has twice the efficiency reaches the same error in half of the time.",
                "note",
            )
    return found


def as_table(rows: list[dict]) -> str:
    """A table of rows of names and numbers."""
    return page.table(in_words(rows), list(rows[0]))


def in_words(rows: list[dict]) -> list[dict]:
    """Rows whose numbers are words: errors in percent, others with three digits."""
    return [{name: in_word(name, value) for name, value in row.items()} for row in rows]


def in_word(name: str, value) -> str:
    """One value of a column of that name."""
    if name.startswith(PERCENT):
        return percent(value)
    return show(value) if isinstance(value, float) else str(value)


def table_of_knobs(study: Study) -> str:
    """A table of what turning one knob alone changes."""
    rows = [
        {
            **{name: row[name] for name in ("knob", "from", "to", "with")},
            "time of a sample": ratio_in_words(row["time low"], row["time high"], row["time"]),
            "error at equal samples": ratio_in_words(row["error low"], row["error high"], row["error"]),
            "error² x time": show(row["error² x time"]),
        }
        for row in knob_table(study)
    ]
    if not rows:
        return ""
    note = (
        "Both are multiples of those before the change, with 95 % intervals. Where error² × time is below 1, the "
        "change pays: it reaches the same error sooner."
    )
    return page.table(rows, list(rows[0])) + page.paragraph(note, "note")


def pictures(study: Study) -> list[str]:
    """The reference; then, for every variant, the picture after the same time, and where it is wrong."""
    shown = [c for c in study.curves if c.image is not None]
    if not shown:
        return []
    maps = [np.abs(c.image - study.references[c.variant.lookup]).mean(axis=2) for c in shown]
    largest = float(np.quantile(np.concatenate([m.ravel() for m in maps]), WHITE))
    of_mean = largest / max(float(study.reference.mean()), 1e-30)
    parts = [f"<h2>Pictures after the same {study.equal_seconds:.2g} s of rendering</h2>"]
    parts += [page.paragraph("Error in each pixel, on one scale for all maps:", "note")]
    parts.append(page.scale_of_heat(f"{in_percent(of_mean)} of the mean brightness, or more"))
    usual = study.curves[0].variant.sampler
    main = [c for c in main_curves(study) if c.variant.sampler == usual]
    cards, others = [], []
    for curve, errors in zip(shown, maps, strict=True):
        (cards if any(curve is c for c in main) else others).append(card(study, curve, errors, largest))
    parts += cards
    if others:
        parts.append(f"<details><summary>The other variants</summary>{''.join(others)}</details>")
    return parts


def card(study: Study, curve: Curve, errors: np.ndarray, largest: float) -> str:
    """One variant: its picture, where it is wrong, and the reference beside it."""
    words = f"{curve.variant.label}: {curve.image_samples} samples per pixel, error {in_percent(curve.image_error)}"
    more = f"relMSE {curve.image_rel_mse:.3g}, FLIP {curve.image_flip:.3g}"
    three = (
        page.picture(curve.image, more, SHOWN, srgb=True),
        page.picture(heat(errors, largest), "error", SHOWN),
        page.picture(study.references[curve.variant.lookup], "reference", SHOWN, srgb=True),
    )
    return f"<section class='card'><h3>{page.html.escape(words)}</h3><div class='pair'>{''.join(three)}</div></section>"


def show(value: float) -> str:
    """Three digits, or "?"."""
    return "?" if math.isnan(value) else digits(value, ".3g")


def percent(value: float) -> str:
    """A fraction in percent, with three digits, or "?"."""
    return f"{show(100 * value)} %"


def table_rows(study: Study) -> list[dict]:
    """A row for every picture that was compared: variant, seed, samples, seconds, error."""
    return [row for curve in study.curves for row in rows_of(curve)]


def rows_of(curve: Curve) -> list[dict]:
    """The rows of one variant."""
    settings = {f: getattr(curve.variant, f) for f in curve.variant.__dataclass_fields__}
    return [
        {
            **settings,
            "seed": seed + 1,
            "samples": int(curve.samples[k]),
            "seconds": float(curve.mean_seconds[k]),
            "relative_rmse": float(curve.errors[seed, k]),
            "noise": float(curve.noise[seed, k]),
            "missing_light": -curve.shift,
            "missing_light_standard_error": curve.shift_error,
            "compile_seconds": curve.compile_seconds,
        }
        for seed in range(len(curve.errors))
        for k in range(len(curve.samples))
        if not math.isnan(curve.errors[seed, k])
    ]


def as_csv(study: Study) -> str:
    """``table_rows`` as CSV; the first line names the columns."""
    buffer, rows = io.StringIO(), table_rows(study)
    writer = csv.DictWriter(buffer, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue()


def as_json(study: Study) -> str:
    """Everything but the pictures, as JSON; a number that is not known is null."""
    content = {
        "scene": study.scene,
        "size": list(study.size),
        "machine": study.machine,
        "budget": study.budget,
        "seconds": study.seconds,
        "start_seconds": study.start_seconds,
        "read_seconds": study.read_seconds,
        "kernels_compiled": study.kernels_made,
        "reference": {
            "samples": study.reference_samples,
            "relative_rmse": float(study.reference_error),
            "max_bounces": study.reference_bounces,
        },
        "summary": summary(study),
        "costs": efficiency_table(study),
        "knobs": knob_table(study),
        "bounces": bounce_table(study),
        "roulettes": efficiency_of(study, "roulette"),
        "lamp choices": efficiency_of(study, "lamp_choice"),
        "measurements": table_rows(study),
    }
    return json.dumps(without_nan(content), indent=1)


def without_nan(value):
    """A value in which None stands for every number that is not finite: JSON has no NaN."""
    if isinstance(value, dict):
        return {k: without_nan(v) for k, v in value.items()}
    if isinstance(value, list):
        return [without_nan(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
