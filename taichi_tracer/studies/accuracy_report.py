"""A study of accuracy as files: one page of HTML, a chart, and the numbers as CSV and JSON."""

import csv
import io
import json
import math
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import replace_file
from taichi_tracer.studies import page
from taichi_tracer.studies.accuracy_chart import draw, png_of, svg_of
from taichi_tracer.studies.accuracy_tables import (
    bounce_table,
    efficiency_of,
    efficiency_table,
    knob_table,
    show_seconds,
    summary,
)
from taichi_tracer.studies.convergence import TARGETS, Curve, Study
from taichi_tracer.system.digits import digits

FILES = ("accuracy.html", "accuracy.csv", "accuracy.json", "accuracy.png")
SECONDS = 2.5  # times what the program takes to start is what writing takes
SHOWN = 240  # pixels, width of a picture in the page
CROP = 0.25  # side of the crop, as a share of the picture's
CROP_STEP = 4  # pixels between two places where the crop may lie: to look at every pixel would take seconds
WHITE = 0.99  # quantile of all errors that is shown as white: a few pixels would leave the rest black


def contents(study: Study) -> dict[str, bytes]:
    """Name → content of ``FILES``."""
    figure = draw(study)
    made = as_html(study, figure).encode(), as_csv(study).encode(), as_json(study).encode(), png_of(figure)
    return dict(zip(FILES, made, strict=True))


def write(study: Study, folder: Path) -> list[Path]:
    """Write ``FILES`` into a folder that exists; returns their paths."""
    for name, content in contents(study).items():
        replace_file(folder / name, content)
    return [folder / name for name in FILES]


def as_html(study: Study, figure) -> str:
    """The whole page."""
    width, height = study.size
    about = (
        f"{width}×{height} pixels, {study.seeds} seeds each, {study.seconds:.0f} s in all ({study.machine}). The "
        f"reference has {study.reference_samples} samples per pixel and a relative error of {study.reference_error} "
        "itself, which was taken off; errors that are not clearly larger are left out."
    )
    if study.reference_bounces is not None:
        about += f" In it, light bounces at most {study.reference_bounces} times."
    parts = [page.paragraph(about, "note"), *(page.paragraph(s) for s in summary(study))]
    parts += ["<h2>Error against time</h2>", svg_of(figure)]
    band = "Lines are the mean over the seeds, bands their spread. Compiling happens once and is shown beside."
    parts.append(page.paragraph(band, "note"))
    questions = tables_of_questions(study)
    for title, content in questions.items():
        parts += [f"<h2>{title}</h2>", content]
    parts += ["<h2>What an error costs</h2>", table_of_costs(study)]
    if knob_table(study) or not questions:
        parts += ["<h2>What each knob buys</h2>", table_of_knobs(study)]
    parts += [f"<h2>The same {study.equal_seconds:.2g} s</h2>", *pictures(study)]
    return page.page(f"What accuracy costs in time: {study.scene}", parts)


def table_of_costs(study: Study) -> str:
    """A table of the seconds to each error, and of the numbers that they follow from."""
    rows = []
    for curve, numbers in zip(study.curves, efficiency_table(study), strict=True):
        row = {"variant": numbers["variant"]}
        row |= {f"to {t:.0%}": show_seconds(curve.seconds_to(t)) for t in TARGETS}
        row[f"ratio at {TARGETS[2]:.0%}"] = show(numbers[f"ratio at {TARGETS[2]:.0%}"])
        for name in ("ms per sample", "variance x time", "slope", "compile s", "bias z"):
            row[name] = show(numbers[name])
        rows.append(row)
    note = (
        "“About” stands where no picture was so good: the slope was continued. A bias z beyond ±3 would mean that the "
        "variant or the reference is biased."
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
        {name: show(value) if isinstance(value, float) else value for name, value in r.items()}
        for r in knob_table(study)
    ]
    if not rows:
        return page.paragraph("Only one setting of every knob was measured.")
    note = (
        "Error at equal samples, and time per sample, are multiples of those before the change. "
        "Where error² × time is below 1, the change pays."
    )
    return page.table(rows, list(rows[0])) + page.paragraph(note, "note")


def pictures(study: Study) -> list[str]:
    """For every variant, the picture after the same time, a crop, and where it is wrong."""
    shown = [c for c in study.curves if c.image is not None]
    if not shown:
        return []
    maps = [np.abs(c.image - study.references[c.variant.lookup]).mean(axis=2) for c in shown]
    largest = float(np.quantile(np.concatenate([m.ravel() for m in maps]), WHITE))
    y, x = noisiest(np.where(without_glare(study.reference), maps[-1], 0))
    parts = [page.picture(study.reference, "reference", SHOWN, srgb=True), "<br>"]
    for curve, errors in zip(shown, maps, strict=True):
        rows, columns = crop_of(errors.shape, y, x)
        caption = f"{curve.variant.label}: {curve.image_samples} spp, error {100 * curve.image_error:.3g} %"
        caption += f", relMSE {curve.image_rel_mse:.3g}, FLIP {curve.image_flip:.3g}"
        parts.append(page.picture(curve.image, caption, SHOWN, srgb=True))
        parts.append(page.picture(curve.image[rows, columns], "crop", SHOWN // 2, srgb=True))
        parts.append(page.picture(page.heat(errors, largest), "error: black none, white large", SHOWN) + "<br>")
    return parts


def noisiest(errors: np.ndarray) -> tuple[int, int]:
    """The middle of the crop with the largest error."""
    rows, columns = (max(1, int(CROP * n)) for n in errors.shape)
    windows = np.lib.stride_tricks.sliding_window_view(errors, (rows, columns))[::CROP_STEP, ::CROP_STEP]
    means = windows.mean(axis=(2, 3))
    y, x = np.unravel_index(int(means.argmax()), means.shape)
    return CROP_STEP * int(y) + rows // 2, CROP_STEP * int(x) + columns // 2


def crop_of(shape: tuple[int, int], y: int, x: int) -> tuple[slice, slice]:
    """Rows and columns of the crop about a pixel."""
    slices = []
    for middle, n in ((y, shape[0]), (x, shape[1])):
        side = max(1, int(CROP * n))
        first = min(max(0, middle - side // 2), n - side)
        slices.append(slice(first, first + side))
    return slices[0], slices[1]


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
            "seconds": float(curve.seconds[seed, k]),
            "relative_rmse": float(curve.errors[seed, k]),
            "noise": float(curve.noise[seed, k]),
            "missing_light": -curve.shift,
            "missing_light_standard_error": curve.shift_error,
            "compile_seconds": curve.compile_seconds,
        }
        for seed in range(len(curve.seconds))
        for k in range(len(curve.samples))
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
        "seconds": study.seconds,
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
