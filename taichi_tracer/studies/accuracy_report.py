"""A study of accuracy as files: one page of HTML with its charts, a chart alone, and the numbers as CSV and JSON.

Curves and bars are labelled where they are, in their colours, so that a reader in the last row need not go back and
forth between a line and a legend.
"""

import math
import textwrap
from pathlib import Path
from threading import Thread

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.files.disk import replace_file
from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.studies import accuracy_sentences as sentences
from taichi_tracer.studies import accuracy_tables as tables
from taichi_tracer.studies import drawing
from taichi_tracer.studies.accuracy_sentences import show, told
from taichi_tracer.studies.accuracy_tables import main_curves
from taichi_tracer.studies.convergence import TARGETS, Curve, Study
from taichi_tracer.studies.drawing import COLOURS, FONT, GRID, INK, SMALL
from taichi_tracer.tones.heat import heat

FILES = ("accuracy.html", "accuracy.csv", "accuracy.json", "accuracy.svg", "accuracy.png")
# Times what a process takes to start is what all files take, or the figure alone: 0.7 s and 1.2 s on an idle machine
# with two processors, 2.4 s and 3.2 s on a busy one.
WRITING, DRAWING = 1.8, 0.6
PARTS = {"start": "#9aa5b1", "read": "#6b7f93", "compile": "#d9820b", "render": "#2f7fc1"}  # of a wait
TIME, ERROR = PARTS["compile"], PARTS["render"]
LABEL_GAP = 0.052  # of the height of the axes: the distance between the middles of two labels
ROOM_FOR_TWO_LINES = 0.08  # of the height of the axes
SHOWN = 512  # pixels, width of a picture in the page where there is room
WHITE = 0.99  # quantile of all errors that is shown as white: a few pixels would leave the rest black
LEFT_OUT = "Not compared", "Others did not reach"  # how sentences begin whose list is folded
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


# Of the charts of the page: inches of width, of height and of a row of bars, and where the axes begin and end, in
# fractions of the width. A telephone shows the narrow ones 360 pixels wide, so that a point has more than a pixel.
SHAPES = {
    "broad": (12, 6.6, 0.42, {"curves": (0.075, 0.69), "knobs": (0.25, 0.72), "wait": (0.12, 0.82)}),
    "narrow": (4.8, 7, 0.56, {"curves": (0.19, 0.54), "knobs": (0.35, 0.64), "wait": (0.26, 0.58)}),
}
NARROW_LABEL = 16  # letters beside an axis in a narrow chart, before the next line begins


def get_ready() -> None:
    """Load what draws the charts, beside the measurement: that takes half a second."""

    def load() -> None:
        import matplotlib.figure  # noqa: F401

    Thread(target=load, daemon=True).start()


def contents(study: Study) -> dict[str, bytes]:
    """Name → content of ``FILES``."""
    figure = draw(study)
    made = (as_html(study), tables.as_csv(study), tables.as_json(study), drawing.plain_svg(figure, "accuracy"))
    return dict(zip(FILES, [*(text.encode() for text in made), drawing.png_of(figure)], strict=True))


def write(study: Study, folder: Path) -> list[Path]:
    """Write ``FILES`` into a folder that exists; returns their paths."""
    for name, content in contents(study).items():
        replace_file(folder / name, content)
    return [folder / name for name in FILES]


# ── charts ──


def draw(study: Study):
    """A ``matplotlib`` figure of everything: the curves, and beside them what knobs change and what a user waits."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(19, 9), facecolor=drawing.PAPER)
    figure.suptitle(study.facts.title, x=0.05, y=0.985, ha="left", fontsize=FONT + 5, color=INK)
    draw_curves(study, figure.add_axes((0.05, 0.085, 0.36, 0.84)))
    rows = len(tables.knob_rows(study))
    height = min(0.06 * rows, 0.48)
    if rows:
        draw_knobs(study, figure.add_axes((0.70, 0.91 - height, 0.16, height)))
    draw_wait(study, figure.add_axes((0.70, 0.085, 0.22, 0.64 - height if rows else 0.6)))
    return figure


def chart(study: Study, name: str) -> str:
    """One chart for a page: "curves", "knobs" or "wait", for broad and for narrow screens, as wide as the page."""
    return f"<div class='chart'>{''.join(chart_in(study, name, shape) for shape in SHAPES)}</div>"


def chart_in(study: Study, name: str, shape: str) -> str:
    """A chart as SVG in one shape, with values that appear under the mouse."""
    figure, titles = figure_of(study, name, shape)
    return f"<div class='{shape}'>{drawing.svg_of(figure, f'{shape}-{name}', titles)}</div>"


def figure_of(study: Study, name: str, shape: str):
    """(the ``matplotlib`` figure of a chart, group of points → what each of them is)."""
    from matplotlib.figure import Figure

    rows = {"knobs": len(tables.knob_rows(study)), "wait": len(waits(study)[1])}
    width, height, of_row, sides = SHAPES[shape]
    if name in rows:
        height = 1.3 + of_row * rows[name]
    figure = Figure(figsize=(width, height), facecolor="none")
    left, right = sides[name]
    axes = figure.add_axes((left, 0.72 / height, right - left, 1 - 1.15 / height))
    return figure, {"curves": draw_curves, "knobs": draw_knobs, "wait": draw_wait}[name](study, axes)


def is_narrow(axes) -> bool:
    """Whether there is no room for long labels."""
    return axes.figure.get_figwidth() <= SHAPES["narrow"][0]


def beside_axis(axes, labels: list[str]) -> list[str]:
    """Labels of rows, in several lines where there is no room."""
    return [textwrap.fill(label, NARROW_LABEL) if is_narrow(axes) else label for label in labels]


def draw_curves(study: Study, axes) -> dict[str, list[str]]:
    """Error against seconds; returns group of points → what each of them is."""
    main, titles, ends = main_curves(study), {}, []
    names = list(dict.fromkeys(without_sampler(c) for c in main))
    samplers = list(dict.fromkeys(c.variant.sampler for c in main))
    for i, curve in enumerate(main):
        colour = COLOURS[names.index(without_sampler(curve)) % len(COLOURS)]
        is_first, known = curve.variant.sampler == samplers[0], curve.mean_errors > 0
        seconds, errors = curve.mean_seconds[known], 100 * curve.mean_errors[known]
        if not known.any():
            continue
        low, high = (100 * f(curve.errors[:, known], axis=0) for f in (np.nanmin, np.nanmax))
        axes.fill_between(seconds, low, high, color=colour, alpha=0.12, linewidth=0)
        line, width, size = ("-", 2.4, 6) if is_first else ((0, (4, 2)), 1.6, 4.5)
        axes.loglog(seconds, errors, color=colour, linestyle=line, linewidth=width)
        axes.loglog(seconds, errors, "o", markersize=size, color=colour, gid=f"points-{i}")
        titles[f"points-{i}"] = [
            f"{curve.variant.label}: {percent(e / 100)} after {s:.3g} s, {n:,} samples per pixel"
            for s, e, n in zip(seconds, errors, curve.samples[known], strict=True)
        ]
        text = curve.variant.label if len(samplers) > 1 else without_sampler(curve)
        if is_narrow(axes):  # the colour and its first label say which it is
            text = without_sampler(curve) if is_first else curve.variant.sampler
        ends.append((seconds[-1], errors[-1], f"{text}: {percent(errors[-1] / 100)}", colour, is_first))
    prepare_curves(study, axes)
    label_ends(axes, ends)
    return titles


def without_sampler(curve: Curve) -> str:
    """The label of a curve without the name of its sampler."""
    return ", ".join(part for part in curve.variant.label.split(", ") if part != curve.variant.sampler)


def prepare_curves(study: Study, axes) -> None:
    """Axes, ticks in percent and seconds, a line for each target, and a guide of slope −1/2."""
    (x0, x1), (y0, y1), truth = axes.get_xlim(), axes.get_ylim(), 100 * study.truth.error
    y0 = min(y0, 100 * TARGETS[2] * 0.9)
    for target in TARGETS:
        if y0 < 100 * target < y1:
            axes.axhline(100 * target, color=GRID, linewidth=2.2, zorder=0)
    small = {"fontsize": SMALL, "textcoords": "offset points"}
    if truth > y0:
        axes.axhspan(y0, truth, color="#8a97a5", alpha=0.13, linewidth=0)
        words = f"reference: {percent(study.truth.error)}; below, pictures tell their own error"
        words = textwrap.fill(words, 20 if is_narrow(axes) else 36)
        is_broad = math.log(truth / y0) > ROOM_FOR_TWO_LINES * math.log(y1 / y0)
        place = {"xytext": (0, -3), "va": "top"} if is_broad else {"xytext": (0, 3), "va": "bottom"}
        drawing.write(axes, words, (0.01, truth), xycoords=("axes fraction", "data"), **place, **small)
    x = np.array([x0, x0**0.65 * x1**0.35, x1])
    guide = 0.75 * y1 * (x / x0) ** -0.5
    axes.loglog(x, guide, color=INK, linestyle=":", linewidth=1.2)
    halved = "4 times the time,\nhalf the error" if is_narrow(axes) else "4 times the time, half the error"
    drawing.write(axes, halved, (x[1], guide[1]), xycoords="data", xytext=(4, 6), **small)
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    drawing.set_ticks(axes.xaxis, x0, x1, drawing.seconds_in_words)
    drawing.set_ticks(axes.yaxis, y0, y1, lambda v: f"{v:,.10g} %")
    drawing.dress(axes, "seconds of rendering, without compiling")
    axes.set_title("relative RMSE of all pixels", loc="left", x=0.01, y=1.0, fontsize=FONT, color=INK)


def label_ends(axes, ends: list) -> None:
    """The label of each curve right of the axes, as high as its end, or as near to it as the others leave room."""
    y0, y1 = (math.log(y) for y in axes.get_ylim())
    order = sorted(ends, key=lambda end: end[1])
    wanted = [(math.log(end[1]) - y0) / (y1 - y0) for end in order]
    for (x, y, text, colour, is_first), place in zip(order, drawing.spread(wanted, LABEL_GAP), strict=True):
        arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.7, "alpha": 0.55, "shrinkA": 1}
        weight = "bold" if is_first and not is_narrow(axes) else "normal"
        size = {"fontsize": SMALL if is_narrow(axes) else FONT}
        beside = {"xycoords": "data", "xytext": (1.03, place), "textcoords": "axes fraction", "va": "center"}
        drawing.write(axes, text, (x, y), colour, **beside, **size, fontweight=weight, arrowprops=arrow)


def draw_knobs(study: Study, axes) -> dict[str, list[str]]:
    """For each knob, by which factor it changes the seconds of a sample and the error, with 95 % intervals."""
    rows, titles = tables.knob_rows(study), {}
    for i, row in enumerate(rows):
        for name, offset, marker, colour in (("time", -0.16, "o", TIME), ("error", 0.16, "D", ERROR)):
            ratio, low, high = row[name], row[f"{name} low"], row[f"{name} high"]
            place = {"xycoords": ("axes fraction", "data"), "va": "center", "fontsize": SMALL}
            drawing.write(axes, f"× {in_short(ratio, low, high)}", (1.02, i + 1.2 * offset), colour, **place)
            if not ratio > 0:
                continue
            alpha, gid = 0.35 if tables.is_noise(ratio, low, high) else 1.0, f"{name}-{i}"
            bar = {"linewidth": 3, "alpha": 0.4 * alpha, "solid_capstyle": "butt"}
            axes.plot([low, high], [i + offset] * 2, color=colour, **bar)
            axes.plot([ratio], [i + offset], marker, color=colour, alpha=alpha, markersize=7, gid=gid)
            titles[gid] = [f"{row['to']}: {name} × {ratio:.3g} ({low:.3g} to {high:.3g})"]
    values = [row[k] for row in rows for k in ("time low", "time high", "error low", "error high") if row[k] > 0]
    low, high = max(min(0.45, 0.9 * min(values)), 0.1), min(max(2.2, 1.1 * max(values)), 10)
    axes.axvline(1, color=INK, linewidth=1)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    labels = beside_axis(axes, [sentences.named(row, sentences.BESIDE_CHARTS) for row in rows])
    axes.set_yticks(range(len(rows)), labels)
    drawing.set_ticks(axes.xaxis, low, high, lambda v: f"{v:g} ×")
    drawing.dress(axes, "times that of the first variant")
    drawing.write(axes, "● time", (0, 1.02), TIME, va="bottom")
    drawing.write(axes, "◆ error", (1, 1.02), ERROR, va="bottom", ha="right")
    return titles


def in_short(ratio: float, low: float, high: float) -> str:
    """A ratio with two digits, or "noise"."""
    if math.isnan(ratio):
        return "?"
    return f"{low:.2g}–{high:.2g}, noise" if tables.is_noise(ratio, low, high) else f"{ratio:.2f}"


def waits(study: Study) -> tuple[float, list[tuple[Curve, float]]]:
    """(an error, the curves of the first sampler with the seconds until each has it; NaN if it was not reached)."""
    main = main_curves(study)
    first = [c for c in main if c.variant.sampler == main[0].variant.sampler]
    target = next((t for t in reversed(TARGETS[:3]) if any(c.seconds_to(t) > 0 for c in first)), TARGETS[0])
    return target, [(c, c.seconds_to(target)) for c in first]


def draw_wait(study: Study, axes) -> dict[str, list[str]]:
    """A bar per estimator: starting, reading, compiling, and rendering until an error is reached."""
    target, rows = waits(study)
    farthest, gap = 0.0, "\n " if is_narrow(axes) else " "
    for i, (curve, seconds) in enumerate(rows):
        is_reached, left = seconds > 0, 0.0
        rendering = seconds if is_reached else curve.best[0]
        parts = (study.start_seconds, study.facts.read_seconds, curve.compile_seconds, rendering)
        for (name, colour), part in zip(PARTS.items(), parts, strict=True):
            part = 0.0 if math.isnan(part) else part
            axes.barh([i], [part], 0.62, left=left, color=colour, alpha=1.0 if name != "render" or is_reached else 0.35)
            left += part
        farthest = max(farthest, left)
        words = f" {left:.1f} s" if is_reached else f" {percent(curve.best[1])} after{gap}{left:.1f} s"
        drawing.write(axes, words, (left, i), xycoords="data", va="center")
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(0, max(farthest, 1e-3) * 1.05)
    axes.set_yticks(range(len(rows)), beside_axis(axes, [without_sampler(curve) for curve, _ in rows]))
    goal = f" to {100 * target:g} % error" if any(seconds > 0 for _, seconds in rows) else ""
    drawing.dress(axes, f"seconds from the key press{goal}")
    for k, (name, colour) in enumerate(PARTS.items()):
        place = {"xycoords": ("figure fraction", "axes fraction")} if is_narrow(axes) else {}
        at = 0.02 + 0.24 * k if is_narrow(axes) else 0.27 * k
        drawing.write(axes, f"■ {name}", (at, 1.02), colour, va="bottom", **place)
    return {}


# ── the page ──


def as_html(study: Study) -> str:
    """The whole page: findings first, then the charts, the tables, and the pictures."""
    contents = {
        "curves": chart(study, "curves"),
        "knobs": chart(study, "knobs") if tables.knob_rows(study) else None,
        "wait": chart(study, "wait"),
        **{knob: table(rows) for knob, rows in tables.questions(study).items()},
        "pictures": pictures(study),
        "costs": table(costs(study)),
        "changes": table(changes(study)),
        "about": "",
    }
    more = {
        "wait": ["compiled" if study.kernels_made else "kept", "shared"],
        "costs": ["fewer bounces"] if any(curve.is_biased for curve in study.curves) else [],
        "about": [] if study.reference_bounces is None else ["most bounces"],
    }
    findings = "".join(f"<li>{folded(sentence)}</li>" for sentence in tables.summary(study))
    parts = [f"<ul class='findings'>{findings}</ul>"]
    for name, content in contents.items():
        if content is not None:
            title, _, note = told([name, *more.get(name, [])], {"study": study}, sentences.PAGE).partition("\n")
            parts += [f"<h2>{title}</h2>" if title else "", content, page.paragraph(note, "note") if note else ""]
    return page.page(f"What accuracy costs in time: {study.facts.title}", parts, STYLE)


def folded(sentence: str) -> str:
    """HTML of a sentence; what follows the colon of one that says what was left out is opened by a click."""
    head, colon, rest = sentence.partition(": ")
    if not (sentence.startswith(LEFT_OUT) and colon):
        return page.html.escape(sentence)
    return f"<details><summary>{page.html.escape(head)}</summary>{page.html.escape(rest)}</details>"


def table(rows: list[dict]) -> str | None:
    """Rows in words, if there are any, under the names of their columns."""
    return page.table(sentences.in_words(rows), list(rows[0])) if rows else None


def costs(study: Study) -> list[dict]:
    """The seconds to each error, and the numbers that they follow from."""
    rows = []
    for row in tables.efficiency_table(study):
        seconds = {t: row[f"s to {t:.0%}"] for t in TARGETS}
        words = {
            "variant": row["variant"],
            **{f"to {t:.0%}": "not reached" if math.isnan(s) else f"{s:.3g} s" for t, s in seconds.items()},
            "best error": f"{percent(row['best error'])} after {row['after s']:.3g} s",
            "ms per sample": show(row["ms per sample"]) + " (uncertain)" * (row["time factor"] > tables.CERTAIN),
        }
        rows.append(words | {name: row[name] for name in ("variance x time", "compile s", "bias z")})
    return rows


def changes(study: Study) -> list[dict]:
    """What turning one knob alone changes."""
    rows = []
    for row in tables.knob_table(study):
        words = {name: row[name] for name in ("knob", "from", "to", "with")}
        for name, column in (("time", "time of a sample"), ("error", "error at equal samples")):
            ratio = {"ratio": row[name], "low": row[f"{name} low"], "high": row[f"{name} high"]}
            words[column] = told([tables.kind_of_ratio(**ratio)], ratio, sentences.RATIOS)
        rows.append(words | {"error² x time": row["error² x time"]})
    return rows


def pictures(study: Study) -> str | None:
    """For every variant: the picture after the same time, where it is wrong, and the reference beside it."""
    shown = [c for c in study.curves if c.shown is not None]
    if not shown:
        return None
    truths = [study.truths[c.variant.lookup].image for c in shown]
    maps = [np.abs(c.shown.image - truth).mean(axis=2) for c, truth in zip(shown, truths, strict=True)]
    largest = float(np.quantile(np.concatenate([m.ravel() for m in maps]), WHITE))
    of_mean = largest / max(study.truth.mean, 1e-30)
    cards: dict[bool, str] = {True: "", False: ""}
    main = [c for c in main_curves(study) if c.variant.sampler == study.base.sampler]
    for curve, truth, errors in zip(shown, truths, maps, strict=True):
        cards[curve in main] += card(curve, truth, heat(errors, largest))
    if cards[False]:
        cards[True] += f"<details><summary>The other variants</summary>{cards[False]}</details>"
    scale = page.scale_of_heat(f"{percent(of_mean)} of the mean brightness, or more")
    return page.paragraph(sentences.PICTURES, "note") + scale + cards[True]


def card(curve: Curve, reference: np.ndarray, errors: np.ndarray) -> str:
    """One variant: its picture, where it is wrong, and the reference beside it."""
    shown = curve.shown
    words = f"{curve.variant.label}: {shown.samples} samples per pixel, error {percent(shown.error)}"
    three = (
        page.picture(shown.image, f"relMSE {shown.rel_mse:.3g}, FLIP {shown.flip:.3g}", SHOWN, srgb=True),
        page.picture(errors, "error", SHOWN),
        page.picture(reference, "reference", SHOWN, srgb=True),
    )
    return f"<section class='card'><h3>{page.html.escape(words)}</h3><div class='pair'>{''.join(three)}</div></section>"
