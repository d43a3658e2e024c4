"""The chart of a study of accuracy: error against seconds of rendering, with bands over seeds, and compile seconds."""

import io
from dataclasses import replace

import numpy as np

from taichi_tracer.studies.accuracy_tables import MAIN
from taichi_tracer.studies.convergence import Study
from taichi_tracer.system.digits import digits

COLOURS = ("#1b6ca8", "#d1495b", "#2e8b57", "#8e5ea2", "#e08e0b", "#5d6d7e", "#17a2b8", "#8c564b", "#b5bd00", "#e377c2")

LEGEND_CHARACTERS, HANDLE_CHARACTERS = 170, 8  # that fit side by side, and that the line before a label takes of them
NOTHING_COMPILED = 0.05  # seconds: a variant that differs by numbers alone runs the kernels of another one


def draw(study: Study):
    """A ``matplotlib`` figure: the curves of error against seconds, and beside them a bar of compile seconds each."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 5.6), layout="constrained")
    axes, bars = figure.subplots(1, 2, width_ratios=(3.2, 1))
    usual = study.curves[0].variant
    main = [c for c in study.curves if set(c.variant.differences(usual)) <= MAIN]
    alike = list(dict.fromkeys(replace(c.variant, sampler=usual.sampler) for c in main))
    for curve in main:
        colour = COLOURS[alike.index(replace(curve.variant, sampler=usual.sampler)) % len(COLOURS)]
        is_first = curve.variant.sampler == usual.sampler
        seconds, known = curve.mean_seconds, curve.mean_errors > 0
        ending = f"slope {digits(curve.slope, '.2f')}"
        if curve.is_biased:
            ending = f"misses {digits(-100 * curve.shift, '.2g')} % of the light"
        label = f"{curve.variant.label} ({ending})"
        style = {"color": colour, "linestyle": "-" if is_first else "--", "marker": "o" if is_first else "x"}
        axes.loglog(seconds[known], 100 * curve.mean_errors[known], label=label, markersize=4, linewidth=1.4, **style)
        low, high = np.min(curve.errors, axis=0), np.max(curve.errors, axis=0)
        axes.fill_between(seconds[known], 100 * low[known], 100 * high[known], color=colour, alpha=0.12, linewidth=0)
    if study.reference_error > 0:
        axes.axhspan(0, 100 * study.reference_error, color="grey", alpha=0.15, linewidth=0)
        text = f"the reference's own error, {100 * study.reference_error:.2g} %"
        axes.annotate(text, (0.01, 100 * study.reference_error), xycoords=("axes fraction", "data"), fontsize=8)
    draw_guide(axes)
    axes.set(xlabel="seconds of rendering", ylabel="relative RMSE, %", title=study.scene)
    axes.grid(True, which="both", alpha=0.2)
    longest = max(len(text) for text in axes.get_legend_handles_labels()[1])
    columns = max(1, LEGEND_CHARACTERS // (longest + HANDLE_CHARACTERS))
    figure.legend(fontsize=7, loc="outside lower center", ncols=columns, frameon=False)
    compiled = [c for c in study.curves if c.compile_seconds > NOTHING_COMPILED] or study.curves
    seconds, height = [c.compile_seconds for c in compiled], min(0.8, 0.1 * len(compiled))
    bars.barh([c.variant.label for c in compiled], seconds, height, color="#9aa5b1")
    bars.set_ylim(len(compiled) - 0.5, -0.5)  # the first at the top
    bars.tick_params(axis="y", labelsize=7)
    bars.set(xlabel="compiling, s (once)")
    return figure


def draw_guide(axes) -> None:
    """Add a dotted line of slope −1/2, which independent samples follow."""
    low, high = axes.get_xlim()
    bottom, top = axes.get_ylim()
    x = np.array([low, high])
    axes.loglog(x, top * 0.7 * (x / low) ** -0.5, color="black", linestyle=":", linewidth=1, label="slope −1/2")
    axes.set_xlim(low, high)
    axes.set_ylim(bottom, top)


def svg_of(figure) -> str:
    """A figure as SVG, to stand in a page."""
    import matplotlib

    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "accuracy"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def png_of(figure) -> bytes:
    """A figure as the bytes of a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    return buffer.getvalue()
