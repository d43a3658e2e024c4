"""The charts of a study of accuracy: error against seconds, what each knob changes, and what a user waits for.

Curves and bars are labelled where they are, in their colours, so that a reader in the last row need not go back and
forth between a line and a legend.
"""

import io
import math
import re
from dataclasses import dataclass
from html import escape

import numpy as np

from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.studies.accuracy_tables import is_noise, knob_table, main_curves
from taichi_tracer.studies.convergence import TARGETS, Curve, Study

COLOURS = ("#2f7fc1", "#d1495b", "#2f9e5b", "#9467bd", "#d9820b", "#6b7f93", "#17a2b8", "#a0664f", "#9aa400", "#d965b0")
INK, GRID, PAPER = "#1c2733", "#d3dae1", "#ffffff"  # of text and axes, of the lines behind them, of the ground
START, READ, COMPILE, RENDER = "#9aa5b1", "#6b7f93", "#d9820b", "#2f7fc1"  # the parts of a wait
FONT = 12  # points
LABEL_GAP = 0.052  # of the height of the axes: the distance between the middles of two labels
ROOM_FOR_LABELS = 0.30  # of the width of a chart: right of its axes
ROOM_FOR_TWO_LINES = 0.08  # of the height of the axes
STEPS = (1, 2, 5), (1, 3), (1,)  # ticks are these times a power of ten: the first of these for which there is room
ROOM_FOR_A_TICK = 0.62, 0.31  # inches: along the horizontal axis, and along the vertical axis


def draw(study: Study):
    """A ``matplotlib`` figure of everything: the curves, and beside them what knobs change and what a user waits."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(19, 9), facecolor=PAPER)
    figure.suptitle(study.scene, x=0.05, y=0.985, ha="left", fontsize=FONT + 5, color=INK)
    draw_curves(study, figure.add_axes((0.05, 0.085, 0.36, 0.84)))
    rows = len(knob_rows(study))
    height = min(0.06 * rows, 0.48)
    if rows:
        draw_knobs(study, figure.add_axes((0.70, 0.91 - height, 0.16, height)))
    draw_wait(study, figure.add_axes((0.70, 0.085, 0.22, 0.64 - height if rows else 0.6)))
    return figure


@dataclass(frozen=True)
class Shape:
    """The sizes of the charts of a page, in inches, and what of the width is left and right of the axes.

    Attributes:
        name: of the class in the page, and of the identifiers in the drawings.
    """

    name: str
    width: float
    height: float
    curves: tuple[float, float]
    knobs: tuple[float, float]
    wait: tuple[float, float]


SHAPES = (
    Shape("broad", 12, 6.6, (0.075, 0.69), (0.25, 0.72), (0.12, 0.82)),
    Shape("narrow", 6.4, 7, (0.13, 0.6), (0.33, 0.68), (0.2, 0.72)),
)


def figures(study: Study) -> dict[str, str]:
    """Name → SVG for a page: each chart for broad and for narrow screens, with values that appear under the mouse."""
    return {name: "".join(chart(study, name, shape) for shape in SHAPES) for name in charts_of(study)}


def charts_of(study: Study) -> list[str]:
    """Which charts there are."""
    return ["curves", "knobs", "wait"] if knob_rows(study) else ["curves", "wait"]


def chart(study: Study, name: str, shape: Shape) -> str:
    """One chart as SVG, in one shape."""
    from matplotlib.figure import Figure

    rows = {"knobs": len(knob_rows(study)), "wait": len(waits(study)[1])}
    height = 1.3 + 0.42 * rows[name] if name in rows else shape.height
    figure = Figure(figsize=(shape.width, height), facecolor="none")
    left, right = getattr(shape, name)
    axes = figure.add_axes((left, 0.72 / height, right - left, 1 - 1.15 / height))
    draw_it = {"curves": draw_curves, "knobs": draw_knobs, "wait": draw_wait}[name]
    return f"<div class='{shape.name}'>{svg_of(figure, f'{shape.name}-{name}', draw_it(study, axes))}</div>"


# ── error against seconds ──


def draw_curves(study: Study, axes) -> dict[str, list[str]]:
    """The curves into a pair of axes; returns group of points → what each of them is."""
    main, titles = main_curves(study), {}
    names = list(dict.fromkeys(without_sampler(c) for c in main))
    samplers = list(dict.fromkeys(c.variant.sampler for c in main))
    ends = []
    for i, curve in enumerate(main):
        colour = COLOURS[names.index(without_sampler(curve)) % len(COLOURS)]
        is_first = curve.variant.sampler == samplers[0]
        known = curve.mean_errors > 0
        seconds, errors = curve.mean_seconds[known], 100 * curve.mean_errors[known]
        if not known.any():
            continue
        low, high = (100 * f(curve.errors[:, known], axis=0) for f in (np.nanmin, np.nanmax))
        axes.fill_between(seconds, low, high, color=colour, alpha=0.12, linewidth=0)
        style = {"color": colour, "linestyle": "-" if is_first else (0, (4, 2)), "linewidth": 2.4 if is_first else 1.6}
        axes.loglog(seconds, errors, **style)
        size = 6 if is_first else 4.5
        axes.loglog(seconds, errors, marker="o", markersize=size, color=colour, linestyle="", gid=f"points-{i}")
        titles[f"points-{i}"] = [
            f"{curve.variant.label}: {percent(e / 100)} after {s:.3g} s, {n:,} samples per pixel"
            for s, e, n in zip(seconds, errors, curve.samples[known], strict=True)
        ]
        text = curve.variant.label if len(samplers) > 1 else without_sampler(curve)
        if is_narrow(axes):  # the colour says which estimator it is, and its first label names it
            text = without_sampler(curve) if is_first else curve.variant.sampler
        ends.append((seconds[-1], errors[-1], f"{text}: {percent(errors[-1] / 100)}", colour, is_first))
    prepare_curves(study, axes, ends)
    label_ends(axes, ends)
    return titles


def is_narrow(axes) -> bool:
    """Whether the chart is one for a narrow screen, which has no room for long labels."""
    return axes.figure.get_figwidth() <= SHAPES[-1].width


def without_sampler(curve: Curve) -> str:
    """The label of a curve without the name of its sampler."""
    return ", ".join(part for part in curve.variant.label.split(", ") if part != curve.variant.sampler)


def prepare_curves(study: Study, axes, ends: list) -> None:
    """Axes, ticks in percent and seconds, a line for each target, and a guide of slope −1/2."""
    x0, x1 = axes.get_xlim()
    y0, y1 = axes.get_ylim()
    y0 = min(y0, 100 * TARGETS[2] * 0.9)
    for target in TARGETS:
        if y0 < 100 * target < y1:
            axes.axhline(100 * target, color=GRID, linewidth=2.2, zorder=0)
    if study.reference_error > 0 and 100 * study.reference_error > y0:
        axes.axhspan(y0, 100 * study.reference_error, color="#8a97a5", alpha=0.13, linewidth=0)
        what = f"reference: {percent(study.reference_error)}; below, pictures\ntell their own error"
        is_broad = math.log(100 * study.reference_error / y0) > ROOM_FOR_TWO_LINES * math.log(y1 / y0)
        axes.annotate(
            what, (0.01, 100 * study.reference_error), xytext=(0, -3 if is_broad else 3), textcoords="offset points",
            va="top" if is_broad else "bottom", xycoords=("axes fraction", "data"), fontsize=FONT - 2, color=INK,
        )  # fmt: skip
    x = np.array([x0, x1])
    guide = 0.75 * y1 * (x / x0) ** -0.5
    axes.loglog(x, guide, color=INK, linestyle=":", linewidth=1.2)
    at = x0**0.65 * x1**0.35
    axes.annotate(
        "4 times the time, half the error", (at, 0.75 * y1 * (at / x0) ** -0.5), fontsize=FONT - 2, color=INK,
        xytext=(4, 6), textcoords="offset points",
    )  # fmt: skip
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    set_ticks(axes.xaxis, x0, x1, seconds_in_words)
    set_ticks(axes.yaxis, y0, y1, lambda v: f"{v:,.10g} %")
    dress(axes, "seconds of rendering, without compiling")
    axes.set_title("relative RMSE of all pixels", loc="left", x=0.01, y=1.0, fontsize=FONT, color=INK)


def label_ends(axes, ends: list) -> None:
    """The label of each curve right of the axes, as high as its end, or as near to it as the others leave room."""
    y0, y1 = (math.log(y) for y in axes.get_ylim())
    order = sorted(ends, key=lambda end: end[1])
    wanted = [(math.log(end[1]) - y0) / (y1 - y0) for end in order]
    for (x, y, text, colour, is_first), place in zip(order, spread(wanted, LABEL_GAP), strict=True):
        axes.annotate(
            text, (x, y), xytext=(1.03, place), textcoords="axes fraction", color=colour, fontsize=FONT, va="center",
            fontweight="bold" if is_first else "normal", annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.7, "alpha": 0.55, "shrinkA": 1},
        )  # fmt: skip


def spread(wanted: list[float], gap: float) -> list[float]:
    """Ascending places as near as possible to the wanted ones, no two of them nearer than ``gap``."""
    groups: list[list[float]] = []  # of neighbours that touch each other: their wanted places
    for place in wanted:
        groups.append([place])
        while len(groups) > 1 and lowest(groups[-1], gap) - highest(groups[-2], gap) < gap:
            groups[-2:] = [groups[-2] + groups[-1]]
    return [lowest(group, gap) + i * gap for group in groups for i in range(len(group))]


def lowest(group: list[float], gap: float) -> float:
    """Where the first of a group stands, whose middle is the mean of the wanted places."""
    return sum(group) / len(group) - gap * (len(group) - 1) / 2


def highest(group: list[float], gap: float) -> float:
    """Where the last of a group stands."""
    return lowest(group, gap) + gap * (len(group) - 1)


# ── what a knob changes ──


def knob_rows(study: Study) -> list[dict]:
    """The rows of ``knob_table`` in which one knob is turned from the first variant, estimators left to the curves."""
    base = study.curves[0].variant
    return [
        row
        for row in knob_table(study)
        if row["knob"] != "estimator"
        and row["with"] == base.estimator
        and row["from"] == base.setting(row["knob"].replace(" ", "_"))
    ]


def draw_knobs(study: Study, axes) -> dict[str, list[str]]:
    """For each knob, times the seconds of a sample and times the error, with their 95 % intervals."""
    rows, titles = knob_rows(study), {}
    for i, row in enumerate(rows):
        for name, offset, marker, colour in (("time", -0.16, "o", COMPILE), ("error", 0.16, "D", RENDER)):
            ratio, low, high = row[name], row[f"{name} low"], row[f"{name} high"]
            if not ratio > 0:
                continue
            noise = is_noise(ratio, low, high)
            alpha = 0.35 if noise else 1.0
            axes.plot(
                [low, high], [i + offset] * 2, color=colour, linewidth=3, alpha=0.4 * alpha, solid_capstyle="butt"
            )
            gid = f"{name}-{i}"
            axes.plot(
                [ratio], [i + offset], marker=marker, color=colour, alpha=alpha, linestyle="", markersize=7, gid=gid
            )
            titles[gid] = [f"{row['to']}: {name} × {ratio:.3g} ({low:.3g} to {high:.3g})"]
        told = {"time": (-0.16, COMPILE), "error": (0.22, RENDER)}
        for name, (offset, colour) in told.items():
            axes.annotate(
                f"× {in_short(row, name)}", (1.02, i + offset), xycoords=("axes fraction", "data"), va="center",
                fontsize=FONT - 2, color=colour,
            )  # fmt: skip
    values = [row[k] for row in rows for k in ("time low", "time high", "error low", "error high") if row[k] > 0]
    low, high = min(0.45, 0.9 * min(values)), max(2.2, 1.1 * max(values))
    axes.axvline(1, color=INK, linewidth=1)
    axes.set_xscale("log")
    axes.set_xlim(max(low, 0.1), min(high, 10))
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(range(len(rows)), [name_of(row) for row in rows])
    set_ticks(axes.xaxis, max(low, 0.1), min(high, 10), lambda v: f"{v:g} ×")
    dress(axes, "times that of the first variant")
    for x, side, text, colour in ((0, "left", "● time", COMPILE), (1, "right", "◆ error", RENDER)):
        place = {"xycoords": "axes fraction", "ha": side, "va": "bottom", "annotation_clip": False}
        axes.annotate(text, (x, 1.02), color=colour, fontsize=FONT, **place)
    return titles


def name_of(row: dict) -> str:
    """What a row turns, in words that fit beside a chart."""
    if row["knob"] == "sampler":
        return f"{row['to']} numbers"
    names = {"plain forms": "readable code (--plain)", "adaptive": "adaptive sampling", "f64": "Float64"}
    names |= {"moller_trumbore": "Möller–Trumbore", "resolution x 0.5": "half the resolution"}
    return f"{row['to']} look-up" if row["knob"] == "lookup" else names.get(row["to"], row["to"])


def in_short(row: dict, name: str) -> str:
    """A ratio with two digits, or "noise"."""
    ratio, low, high = row[name], row[f"{name} low"], row[f"{name} high"]
    if math.isnan(ratio):
        return "?"
    if is_noise(ratio, low, high):
        return f"{low:.2g}–{high:.2g}, noise"
    return f"{ratio:.2f}"


# ── what a user waits for ──


def waits(study: Study) -> tuple[float, list[tuple[Curve, float]]]:
    """(an error, the curves of the first sampler with the seconds until each has it; NaN if it was not reached)."""
    main = main_curves(study)
    first = [c for c in main if c.variant.sampler == main[0].variant.sampler]
    target = next((t for t in reversed(TARGETS[:3]) if any(c.seconds_to(t) > 0 for c in first)), TARGETS[0])
    return target, [(c, c.seconds_to(target)) for c in first]


def draw_wait(study: Study, axes) -> dict[str, list[str]]:
    """A bar per estimator: starting, reading, compiling, and rendering until an error is reached."""
    target, rows = waits(study)
    titles: dict[str, list[str]] = {}
    farthest = 0.0
    for i, (curve, seconds) in enumerate(rows):
        is_reached = seconds > 0
        rendering = seconds if is_reached else curve.last[0]
        left = 0.0
        parts = (study.start_seconds, study.read_seconds, curve.compile_seconds, rendering)
        for part, colour in zip(parts, (START, READ, COMPILE, RENDER), strict=True):
            part = 0.0 if math.isnan(part) else part
            alpha = 0.35 if colour == RENDER and not is_reached else 1.0
            axes.barh([i], [part], 0.62, left=left, color=colour, alpha=alpha)
            left += part
        farthest = max(farthest, left)
        told = f" {left:.1f} s" if is_reached else f" {percent(curve.last[1])} after {left:.1f} s"
        axes.annotate(told, (left, i), va="center", fontsize=FONT, color=INK, annotation_clip=False)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(0, max(farthest, 1e-3) * 1.05)
    axes.set_yticks(range(len(rows)), [without_sampler(curve) for curve, _ in rows])
    goal = f" to {100 * target:g} % error" if any(seconds > 0 for _, seconds in rows) else ""
    dress(axes, f"seconds from the key press{goal}")
    words = (("start", START), ("read", READ), ("compile", COMPILE), ("render", RENDER))
    for k, (word, colour) in enumerate(words):
        place = {"xycoords": "axes fraction", "va": "bottom", "annotation_clip": False}
        axes.annotate(f"■ {word}", (0.27 * k, 1.02), color=colour, fontsize=FONT, **place)
    return titles


# ── axes ──


def set_ticks(axis, low: float, high: float, in_words) -> None:
    """Ticks at 1, 2 and 5 times powers of ten, in words; at fewer places if there is no room for so many."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    size = axis.axes.get_window_extent()
    inches = (size.height if axis.axis_name == "y" else size.width) / axis.axes.figure.dpi
    most = inches / ROOM_FOR_A_TICK[axis.axis_name == "y"]
    choices = [
        [v for k in range(first, last + 1) for s in steps if low <= (v := s * 10.0**k) <= high] for steps in STEPS
    ]
    shown = next((choice for choice in choices if len(choice) <= most), choices[-1])
    axis.set_major_locator(FixedLocator(shown))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda v, _: in_words(float(f"{v:.6g}"))))


def seconds_in_words(seconds: float) -> str:
    """ "50 ms", "0.2 s", "10 s"."""
    return f"{1000 * seconds:g} ms" if seconds < 0.1 else f"{seconds:g} s"


def dress(axes, x: str) -> None:
    """The look of a pair of axes."""
    axes.set_facecolor("none")
    axes.set_axisbelow(True)
    axes.grid(True, color=GRID, linewidth=0.7)
    axes.tick_params(colors=INK, labelsize=FONT, length=0)
    for name, spine in axes.spines.items():
        spine.set_visible(name in ("left", "bottom"))
        spine.set_color(INK)
    axes.set_xlabel(x, fontsize=FONT, color=INK)


# ── files ──


def svg_of(figure, name: str, titles: dict[str, list[str]]) -> str:
    """A figure as SVG, to stand in a page whose colours it takes.

    Args:
        name: differs from those of the other drawings of the page, whose identifiers must differ too.
        titles: group of points → the text that appears while the mouse is over each of them.
    """
    text = plain_svg(figure, name)
    for gid, words in titles.items():
        text = with_titles(text, gid, words)
    for colour, name in ((INK, "ink"), (GRID, "grid")):
        text = text.replace(colour, f"var(--{name})")
    return text


def plain_svg(figure, name: str = "accuracy") -> str:
    """A figure as SVG whose letters stay letters."""
    import matplotlib

    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name, "svg.fonttype": "none", "font.family": "sans-serif"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def with_titles(svg: str, gid: str, words: list[str]) -> str:
    """The SVG, in which the points of a group have titles."""
    begin = svg.index(f'id="{gid}"')
    end = svg.find('<g id="', begin)
    end = len(svg) if end < 0 else end
    following = iter(words)

    def titled(match: re.Match) -> str:
        word = next(following, None)
        return match[0] if word is None else f"{match[1]}><title>{escape(word)}</title></use>"

    return svg[:begin] + re.sub(r"(<use\b[^>]*?)/>", titled, svg[begin:end]) + svg[end:]


def png_of(figure) -> bytes:
    """A figure as the bytes of a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    return buffer.getvalue()
