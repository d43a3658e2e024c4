"""A page of HTML that needs no other file: text, tables, drawings and pictures; and the look of the charts."""

import base64
import html
import io
import math
from collections.abc import Sequence

import numpy as np

from taichi_tracer.files.images import encode_png

NUMBERS = (*"+-−×0123456789", "&lt;")  # how cells with numbers begin
STYLE = """
:root { color-scheme: light dark; --ink: #1c2733; --soft: #55626f; --grid: #d3dae1; --paper: #ffffff; --band: #f1f4f7; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e8edf2; --soft: #a4b0bc; --grid: #3b4652; --paper: #14191f; --band: #1f272f; }
}
@media print {
  :root { --ink: #000; --soft: #333; --grid: #ccc; --paper: #fff; --band: #f1f4f7; }
  figure, table, svg { break-inside: avoid; } h2 { break-after: avoid; }
}
body { font: clamp(15px, 0.35vw + 12px, 21px)/1.5 system-ui, sans-serif; max-width: 1500px; margin: 1.2em auto;
  padding: 0 1em; color: var(--ink); background: var(--paper); }
h1, h2 { line-height: 1.2; text-wrap: balance; } h2 { margin-top: 1.6em; }
.wide { overflow-x: auto; } table { border-collapse: collapse; margin: 1em 0; font-size: 0.86em; }
th, td { padding: 4px 9px; border-bottom: 1px solid var(--grid); text-align: right; white-space: nowrap; }
th:first-child, td:first-child, .text { text-align: left; } th { background: var(--band); }
table.sortable th { cursor: pointer; }
th[data-order]::after { content: " ▾"; } th[data-order="-1"]::after { content: " ▴"; }
figure { display: inline-block; margin: 0 10px 14px 0; vertical-align: top; max-width: 100%; }
figcaption { font-size: 0.86em; }
img { image-rendering: pixelated; display: block; max-width: 100%; height: auto; }
svg { max-width: 100%; height: auto; } .note { color: var(--soft); }
.bars { display: grid; grid-template-columns: auto 1fr; gap: 3px 8px; align-items: center; font-size: 0.86em; }
.bars b { font-weight: 400; text-align: right; } .bars span { display: flex; align-items: center; gap: 6px; }
.bars i { height: 14px; flex: none; }
@media screen and (max-width: 700px) {
  body, .cards td { overflow-wrap: anywhere; } th, td { white-space: normal; overflow-wrap: break-word; }
  .cards table, .cards tbody, .cards tr { display: block; } .cards thead { display: none; }
  .cards tr { padding: 0.5em 0; border-bottom: 2px solid var(--grid); }
  .cards td { display: flex; justify-content: space-between; gap: 1em; border: 0; padding: 1px 0; }
  .cards td::before { content: attr(data-head); color: var(--soft); text-align: left; flex: none; max-width: 50%; }
  .cards td:first-child { font-weight: 600; }
  .bars { grid-template-columns: 1fr; } .bars b { text-align: left; }
}
"""

# A click on the head of a column sorts the table by its numbers, or by its words where it has no numbers.
SCRIPT = """
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.querySelectorAll("th")], body = table.tBodies[0];
  heads.forEach((head, column) => head.onclick = () => {
    const order = head.dataset.order === "1" ? -1 : 1;
    heads.forEach(h => delete h.dataset.order);
    head.dataset.order = order;
    const key = row => row.cells[column].textContent.replace(/,/g, "").trim();
    const number = text => parseFloat(text.replace("×", ""));
    [...body.rows].sort((a, b) => {
      const [x, y] = [key(a), key(b)], [m, n] = [number(x), number(y)];
      if (isNaN(m) && isNaN(n)) return order * x.localeCompare(y);
      if (isNaN(m) || isNaN(n)) return isNaN(m) ? 1 : -1;
      return order * (m - n);
    }).forEach(row => body.append(row));
  });
}
"""


def page(title: str, parts: list[str], style: str = "") -> str:
    """A whole document of parts that are HTML already; ``style`` is added to the common one."""
    head = "<meta charset='utf-8'><meta name='viewport' content='width=device-width, initial-scale=1'>"
    head += f"<title>{html.escape(title)}</title><style>{STYLE}{style}</style>"
    body = f"<h1>{html.escape(title)}</h1>" + "".join(parts)
    if any("class='sortable'" in part for part in parts):
        body += f"<script>{SCRIPT}</script>"
    return f"<!doctype html><html lang='en'><head>{head}</head><body>{body}</body></html>\n"


def paragraph(text: str, kind: str = "") -> str:
    """One paragraph."""
    return f"<p class='{kind}'>{html.escape(text)}</p>" if kind else f"<p>{html.escape(text)}</p>"


def table(rows: list[dict], columns: Sequence[str] = ()) -> str:
    """Rows of text under named columns, by default those of the first row; a click on a name sorts them."""
    columns = columns or list(rows[0])
    return cards([{c: html.escape(str(r.get(c, ""))) for c in columns} for r in rows], columns)


def cards(rows: list[dict], columns: Sequence[str]) -> str:
    """``table`` of cells that are HTML already; on a narrow screen, each row is a list of names and values.

    Columns of words stand at the left, and those of numbers at the right.
    """
    numbers = {c: sum(str(row[c]).startswith(NUMBERS) for row in rows) for c in columns}
    kinds = {c: "" if 2 * numbers[c] > len(rows) else " class='text'" for c in columns}
    cells = ("".join(f"<td data-head='{html.escape(c)}'{kinds[c]}>{row[c]}</td>" for c in columns) for row in rows)
    head = "".join(f"<th{kinds[c]}>{html.escape(c)}</th>" for c in columns)
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    rows_and_head = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f"<div class='wide cards'><table class='sortable'>{rows_and_head}</table></div>"


def bars(values: list[tuple[str, float, str]], colour: str) -> str:
    """A bar for each (name, length as a fraction of the longest one, number in words)."""
    rows = (
        f"<b>{html.escape(name)}</b><span><i style='width: {75 * share:.1f}%; background: {colour}'></i>"
        f"{html.escape(number)}</span>"
        for name, share, number in values
    )
    return f"<div class='bars'>{''.join(rows)}</div>"


def picture(image: np.ndarray, caption: str, width: int, srgb: bool = False) -> str:
    """A picture with a caption, shown ``width`` pixels wide."""
    data = base64.b64encode(encode_png(image, srgb=srgb)).decode()
    text = html.escape(caption)
    image_tag = f"<img width='{width}' src='data:image/png;base64,{data}' alt='{text}'>"
    return f"<figure style='width: {width}px'>{image_tag}<figcaption>{text}</figcaption></figure>"


# ── drawings ──


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
