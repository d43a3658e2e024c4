"""A study of accuracy for people: lines for a terminal, a page with charts, and a table of all measurements as CSV.

The page answers three questions: which estimator is best here, and by how much; what an error of 5, 2 and 1 % costs in
seconds, starting included; and what each other knob buys or costs.
"""

import csv
import io
import math
import textwrap
from dataclasses import asdict

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.files.page import COLOURS, FONT, GRID, INK
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.studies.study import SURE_BIAS, TARGETS, Curve, Interval, Study, change
from taichi_tracer.studies.tables import in_columns
from taichi_tracer.studies.variants import is_path
from taichi_tracer.tones.heat import heat

# Inches; where the labels of the curves stand; how many ticks of seconds there is room for.
SHAPES = {"broad": ((11, 5.6), "outside right center", 11), "narrow": ((4.6, 5.4), "outside lower left", 3)}
LETTERS = 34  # of a line of a label
SHOWN = 320  # pixels: the width of a picture in the page
WHITE = 0.99  # quantile of the errors of a picture that its map shows as white
STYLE = """
.first { font-size: 1.2em; font-weight: 600; } .three { display: grid; gap: 14px;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 240px), 1fr)); }
.three figure { margin: 0; width: auto !important; } .three img { width: 100%; }
.narrow { display: none; } @media (max-width: 700px) { .narrow { display: block; } .broad { display: none; } }
"""


# ── sentences ──


def error_in_words(curve: Curve, study: Study) -> str:
    """The error of the last pictures of a variant: the one number that table, chart and text have."""
    value = curve.error.value
    return f"< {percent(study.reference.least_error)}" if math.isnan(value) else percent(value)


def headline(study: Study) -> list[str]:
    """Which variant is best, and by how much; a claim only where the intervals do not overlap."""
    known = sorted((c for c in study.main if c.error.value > 0), key=lambda c: c.error.value)
    seconds = f"after {in_seconds(study.equal_seconds)} of rendering"
    below = [c.label for c in study.main if c not in known]
    if below:
        found = [f"The error of {' and '.join(below)} is below {percent(study.reference.least_error)} {seconds}."]
        return [*found, *(f"{c.label} has {percent(c.error.value)} then." for c in known[-1:])]
    best, *others = known
    alike = [c for c in others if not best.error.high < c.error.low]  # the intervals overlap
    if len(known) == 1:
        found = [f"The error of {best.label} is {percent(best.error.value)} {seconds}."]
    elif alike:
        names = " and ".join(c.label for c in [best, *alike])
        found = [f"{names} have the smallest error {seconds}: {percent(best.error.value)}. They differ by chance only."]
    else:
        found = [f"{best.label} is best: its error is {percent(best.error.value)} {seconds}."]
    for other in [c for c in others if c not in alike][-1:]:
        ratio = other.error.value / best.error.value
        found.append(
            f"{other.label} has {percent(other.error.value)} then, {times(ratio)} times as much: with independent "
            f"samples it would need {times(ratio**2)} times the time for the same picture."
        )
    return found


def biases_of(study: Study) -> list[str]:
    """A line for each variant whose mean differs from that of the reference by more than noise; fewer bounces may."""
    found = []
    for curve in study.curves:
        is_biased = curve.variant.max_bounces < study.curves[0].variant.max_bounces and is_path(curve.variant.estimator)
        if abs(curve.bias) > SURE_BIAS and not is_biased:
            found.append(
                f"{curve.label} is {'brighter' if curve.shift > 0 else 'darker'} than the reference by "
                f"{percent(abs(curve.shift))}, {abs(curve.bias):.0f} standard errors: one of the two is wrong."
            )
    return found


def warnings_of(study: Study) -> list[str]:
    """What the numbers do not say: biases, light that the reference may not have met, what was left out."""
    found, unseen = biases_of(study), study.reference.error.unseen
    if unseen > study.reference.error:
        found.append(f"Light that no sample of the reference met may add {percent(unseen)} to every error.")
    return [*found, *study.notes]


def about(study: Study) -> str:
    """The scene, the reference and the machine."""
    (width, height), rounds = study.bench.size, min(len(curve.rounds) for curve in study.curves)
    return (
        f"{study.facts.title}, {width} × {height} pixels, {rounds} pictures of each variant. The reference has "
        f"{study.reference.samples:,} samples per pixel and an error of {study.reference.error}: errors "
        f"below {percent(study.reference.least_error)} cannot be judged. Measuring took {study.seconds:.1f} s of a "
        f"budget of {study.budget:g} s; starting took {study.start_seconds:.1f} s, reading the scene "
        f"{study.facts.read_seconds:.1f} s, and compiling {study.compiling_seconds:.1f} s before. "
        f"{study.facts.machine}."
    )


def in_seconds(seconds: float) -> str:
    """ "1.23 s", "50 ms"."""
    return f"{1000 * seconds:.2g} ms" if seconds < 0.1 else f"{seconds:.3g} s"


def times(ratio: float) -> str:
    """A ratio with two digits."""
    return f"{ratio:,.0f}" if ratio >= 10 else f"{ratio:.2g}"


def with_interval(found: Interval, sign: str = "") -> str:
    """A number after a sign, and the ends of its interval."""
    if math.isnan(found.value):
        return "unknown"
    ends = "" if found.high == math.inf else f" ({found.low:.3g} to {found.high:.3g})"
    return f"{sign}{found.value:.3g}{ends}"


# ── tables ──


def cost_rows(study: Study) -> list[dict[str, str]]:
    """What errors cost: for each variant that was rendered for the whole time, a row."""
    rows = []
    for curve in study.main:
        before = study.start_seconds + study.facts.read_seconds + curve.compile_seconds
        row = {"": curve.label, "before the first sample": in_seconds(before)}
        for target in TARGETS:
            seconds = curve.seconds_to(target)
            is_judged = target > study.reference_of(curve.variant).least_error
            reached = f"{in_seconds(seconds.value)}, {in_seconds(before + seconds.value)} with the start"
            row[f"to {target:.0%}"] = (
                reached if seconds.value > 0 else "not reached" if is_judged else "cannot be judged"
            )
        row[f"error after {in_seconds(study.equal_seconds)}"] = error_in_words(curve, study)
        rows.append(row)
    return rows


def knob_rows(study: Study) -> list[dict[str, str]]:
    """What turning one knob alone changes, beside the first variant."""
    base, rows = study.curves[0], []
    for curve in study.curves:
        if curve.knob not in ("", "estimator"):
            found = change(base, curve)
            rows.append(
                {
                    "knob": curve.knob.replace("_", " "),
                    "from": base.variant.value_in_words(curve.knob),
                    "to": curve.variant.value_in_words(curve.knob),
                    "time of a sample": with_interval(found.time, "× "),
                    "error after the same time": with_interval(found.error, "× "),
                    "": found.verdict,
                }
            )
    return rows


def number_rows(study: Study) -> list[dict[str, str]]:
    """What each variant reached, and how its mean differs from that of the reference."""
    return [
        {
            "": curve.label,
            "samples": f"{curve.samples:,}",
            "ms per sample": with_interval(Interval(*(1e3 * x for x in curve.sample_seconds))),
            "error": error_in_words(curve, study),
            "compile s": f"{curve.compile_seconds:.2f}",
            "light beside the reference": f"{100 * curve.shift:+.2g} % ± {100 * curve.shift_error:.2g} %",
        }
        for curve in study.curves
    ]


def as_csv(study: Study) -> str:
    """A row for every picture that was compared: knobs, seed, samples, seconds, error; the first line has their names.

    An error that cannot be judged is "nan".
    """
    rows = [
        {
            **asdict(curve.variant),
            "seed": seed + 1,
            "samples": point.samples,
            "seconds": point.seconds,
            "relative_rmse": point.error,
            "compile_seconds": curve.compile_seconds,
        }
        for curve in study.curves
        for seed, points in enumerate(curve.rounds)
        for point in points
    ]
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue()


def as_text(study: Study) -> list[str]:
    """The findings and the tables, for a terminal."""
    lines = [*headline(study), ""]
    for rows in (cost_rows(study), knob_rows(study), number_rows(study)):
        lines += [*in_columns(rows), ""] if rows else []
    return [*lines, *warnings_of(study), about(study)]


# ── the chart ──


def draw(study: Study, shape: str = "broad"):
    """A ``matplotlib`` figure: the error of each curve against seconds of rendering, labelled at its end."""
    from matplotlib.figure import Figure

    size, place, most_ticks = SHAPES[shape]
    figure = Figure(figsize=size, facecolor="none" if shape == "narrow" else page.PAPER, layout="constrained")
    axes = figure.add_subplot(facecolor="none", axisbelow=True, xscale="log", yscale="log")
    lines = []
    for curve, colour in zip(study.main, COLOURS * 2, strict=False):
        levels = np.array(curve.levels())
        if len(levels) == 0:
            continue
        seconds, error, least, most = levels.T
        axes.fill_between(seconds, 100 * least, 100 * most, color=colour, alpha=0.15, linewidth=0)
        label = textwrap.fill(f"{curve.label}: {error_in_words(curve, study)}", LETTERS)
        lines += axes.plot(seconds, 100 * error, "o-", color=colour, linewidth=2, markersize=5, label=label)
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    y0 = min(y0, 90 * TARGETS[-1])
    axes.hlines([100 * target for target in TARGETS], x0, x1, color=GRID, linewidth=2, zorder=0)
    axes.plot([x0, x1], [0.8 * y1, 0.8 * y1 * (x1 / x0) ** -0.5], color=INK, linestyle=":", linewidth=1.2)
    axes.set(xlim=(x0, x1), ylim=(y0, y1))
    page.set_ticks(axes.xaxis, x0, x1, most_ticks, in_seconds)
    page.set_ticks(axes.yaxis, y0, y1, 12, lambda v: f"{v:,.10g} %")
    axes.grid(True, color=GRID, linewidth=0.7)
    axes.tick_params(colors=INK, labelsize=FONT, length=0)
    axes.spines[:].set_color(INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("seconds of rendering, after compiling", fontsize=FONT, color=INK)
    axes.set_title("relative RMSE of all pixels", loc="left", fontsize=FONT, color=INK)
    lines.sort(key=lambda line: -line.get_ydata()[-1])  # as their ends stand
    figure.legend(handles=lines, loc=place, fontsize=FONT, labelcolor="linecolor", frameon=False)
    return figure


# ── the page ──


def as_html(study: Study) -> str:
    """The whole page."""
    first, *more = headline(study)
    chart = "".join(f"<div class='{shape}'>{page.svg_of(draw(study, shape), shape)}</div>" for shape in SHAPES)
    parts = [page.paragraph(first, "first"), *(page.paragraph(text) for text in more), chart]
    parts += [
        page.paragraph(
            "Each line is the mean of several pictures with other random numbers, each band their spread. The dotted "
            "line has half the error after 4 times the time, as independent samples have.",
            "note",
        ),
        "<h2>What an error costs in seconds</h2>",
        page.table(cost_rows(study)),
        page.paragraph(
            "Starting, reading the scene and compiling come before the first sample; a second run compiles nothing. "
            f"Errors below {percent(study.reference.least_error)}, twice that of the reference, cannot be judged: with "
            "a larger --budget, the reference is better.",
            "note",
        ),
    ]
    if rows := knob_rows(study):
        parts += ["<h2>What each knob buys or costs</h2>", page.table(rows)]
        parts.append(
            page.paragraph(f"Beside {study.curves[0].label}; in brackets 95 % intervals. 1 is no change.", "note")
        )
    parts += [f"<h2>Pictures after {in_seconds(study.equal_seconds)} of rendering</h2>", pictures(study)]
    parts.append(page.paragraph("Errors are fractions of the mean brightness of the reference.", "note"))
    parts += ["<h2>All numbers</h2>", page.table(number_rows(study))]
    parts += [page.paragraph(text, "note") for text in [*warnings_of(study), about(study)]]
    return page.page(f"What accuracy costs in time: {study.facts.title}", parts, STYLE)


def pictures(study: Study) -> str:
    """For every variant of the chart: its picture, where it is wrong, and the reference."""
    found = []
    for curve in study.main:
        image, reference = curve.finals[0][0], study.reference_of(curve.variant).image
        errors = np.abs(image - reference).mean(axis=2)
        white = float(np.quantile(errors, WHITE))
        three = (
            page.picture(image, f"{curve.label}: {error_in_words(curve, study)}", SHOWN, srgb=True),
            page.picture(
                heat(errors, white), f"where it is wrong; white: {percent(white / study.reference.image.mean())}", SHOWN
            ),
            page.picture(reference, "reference", SHOWN, srgb=True),
        )
        found.append(f"<div class='three'>{''.join(three)}</div>")
    return "".join(found)


def contents(study: Study) -> dict[str, bytes]:
    """Name → content of each file of a report."""
    return {
        "accuracy.html": as_html(study).encode(),
        "accuracy.csv": as_csv(study).encode(),
        "accuracy.png": page.png_of(draw(study)),
    }
