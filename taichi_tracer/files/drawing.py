"""How the charts of the studies look: axes with ticks in words, labels beside what they name, and drawings as files."""

import io
import math

COLOURS = ("#2f7fc1", "#d1495b", "#2f9e5b", "#9467bd", "#d9820b", "#6b7f93", "#17a2b8", "#a0664f", "#9aa400", "#d965b0")
INK, GRID, PAPER = "#1c2733", "#d3dae1", "#ffffff"  # of text and axes, of the lines behind them, of the ground
FONT = 12  # points
STEPS = (1, 2, 5), (1, 3), (1,)  # ticks are these times a power of ten: the first of these for which there is room


def set_ticks(axis, low: float, high: float, most: int, in_words) -> None:
    """At most so many ticks on a logarithmic axis, at 1, 2 and 5 times powers of ten or at fewer places, in words."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    decades = math.log10(high / low)
    axis.set_major_locator(LogLocator(subs=next((s for s in STEPS if len(s) * decades <= most), STEPS[-1])))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda v, _: in_words(float(f"{v:.6g}"))))


def seconds_in_words(seconds: float) -> str:
    """ "50 ms", "0.2 s", "10 s"."""
    return f"{1000 * seconds:g} ms" if seconds < 0.1 else f"{seconds:g} s"


def dress(axes, x: str) -> None:
    """The look of a pair of axes, and what is along the horizontal one."""
    axes.set_facecolor("none")
    axes.set_axisbelow(True)
    axes.grid(True, color=GRID, linewidth=0.7)
    axes.tick_params(colors=INK, labelsize=FONT, length=0)
    for name, spine in axes.spines.items():
        spine.set_visible(name in ("left", "bottom"))
        spine.set_color(INK)
    axes.set_xlabel(x, fontsize=FONT, color=INK)


def spread(wanted: list[float], gap: float) -> list[float]:
    """Ascending places near the wanted ones, which ascend too, no two nearer than ``gap``, and the last at most 1."""
    places: list[float] = []
    for place in wanted:
        places.append(max(place, places[-1] + gap) if places else place)
    return [place - max(0.0, places[-1] - 1) for place in places]


# ── files ──


def svg_of(figure, name: str) -> str:
    """A figure as SVG, to stand in a page whose colours it takes; letters stay letters.

    Args:
        name: differs from those of the other drawings of the page, whose identifiers must differ too.
    """
    import matplotlib

    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name, "svg.fonttype": "none", "font.family": "sans-serif"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    for colour, variable in ((INK, "ink"), (GRID, "grid")):
        text = text.replace(colour, f"var(--{variable})")
    return text


def png_of(figure) -> bytes:
    """A figure as the bytes of a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    return buffer.getvalue()
