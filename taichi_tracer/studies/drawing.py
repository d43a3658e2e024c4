"""How the charts of the studies look: axes with ticks in words, labels beside what they name, and drawings as files."""

import io
import math
import textwrap

COLOURS = ("#2f7fc1", "#d1495b", "#2f9e5b", "#9467bd", "#d9820b", "#6b7f93", "#17a2b8", "#a0664f", "#9aa400", "#d965b0")
INK, GRID, PAPER = "#1c2733", "#d3dae1", "#ffffff"  # of text and axes, of the lines behind them, of the ground
FONT, SMALL = 12, 11  # points
OF_A_LETTER = 0.55  # of the height of letters: their mean width
STEPS = (1, 2, 5), (1, 3), (1,)  # ticks are these times a power of ten: the first of these for which there is room
ROOM_FOR_A_TICK = 0.62, 0.31  # inches: along the horizontal axis, and along the vertical axis


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
    """The look of a pair of axes, and what is along the horizontal one."""
    axes.set_facecolor("none")
    axes.set_axisbelow(True)
    axes.grid(True, color=GRID, linewidth=0.7)
    axes.tick_params(colors=INK, labelsize=FONT, length=0)
    for name, spine in axes.spines.items():
        spine.set_visible(name in ("left", "bottom"))
        spine.set_color(INK)
    box, width = axes.get_position(), axes.figure.get_figwidth() * 72
    room = (box.x0 + box.x1) * width if box.x0 + box.x1 < 1 else (2 - box.x0 - box.x1) * width
    axes.set_xlabel(textwrap.fill(x, int(room / (OF_A_LETTER * FONT))), fontsize=FONT, color=INK)


def write(axes, text: str, at: tuple[float, float], colour: str = INK, **options) -> None:
    """Text in a pair of axes, in fractions of their size if nothing else is said."""
    usual = {"xycoords": "axes fraction", "fontsize": FONT, "annotation_clip": False}
    axes.annotate(text, at, color=colour, **usual | options)


def spread(wanted: list[float], gap: float) -> list[float]:
    """Ascending places as near as possible to the wanted ones, which ascend too, no two of them nearer than ``gap``.

    Neighbours that would be too near form a group around the mean of their wanted places.
    """
    groups: list[list[float]] = []  # wanted places minus what all gaps below them take
    for i, place in enumerate(wanted):
        groups.append([place - i * gap])
        while len(groups) > 1 and mean(groups[-2]) > mean(groups[-1]):
            groups[-2:] = [groups[-2] + groups[-1]]
    lowest = [mean(group) for group in groups for _ in group]
    return [place + i * gap for i, place in enumerate(lowest)]


def mean(values: list[float]) -> float:
    """The mean of some numbers."""
    return sum(values) / len(values)


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
