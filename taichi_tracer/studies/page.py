"""A page of HTML that needs no other file: text, tables, drawings and pictures."""

import base64
import html

import numpy as np

from taichi_tracer.files.images import encode_png

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1180px; margin: 2em auto; padding: 0 1em; color: #1c2733; }
h1, h2 { line-height: 1.2; } table { border-collapse: collapse; margin: 1em 0; font-size: 12px; }
th, td { padding: 3px 7px; border-bottom: 1px solid #d5dbe1; text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; } th { background: #f2f5f8; }
figure { display: inline-block; margin: 0 10px 14px 0; vertical-align: top; } figcaption { font-size: 12px; }
img { image-rendering: pixelated; display: block; } svg { max-width: 100%; height: auto; } .note { color: #5b6875; }
"""


def page(title: str, parts: list[str], style: str = "") -> str:
    """A whole document of parts that are HTML already; ``style`` is added to the common one."""
    head = f"<meta charset='utf-8'><title>{html.escape(title)}</title><style>{STYLE}{style}</style>"
    body = f"<h1>{html.escape(title)}</h1>" + "".join(parts)
    return f"<!doctype html><html lang='en'><head>{head}</head><body>{body}</body></html>\n"


def paragraph(text: str, kind: str = "") -> str:
    """One paragraph."""
    return f"<p class='{kind}'>{html.escape(text)}</p>" if kind else f"<p>{html.escape(text)}</p>"


def table(rows: list[dict], columns: list[str]) -> str:
    """Rows of text under named columns."""
    head = "".join(f"<th>{html.escape(c)}</th>" for c in columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(str(r.get(c, '')))}</td>" for c in columns) + "</tr>" for r in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def picture(image: np.ndarray, caption: str, width: int, srgb: bool = False) -> str:
    """A picture with a caption, shown ``width`` pixels wide."""
    data = base64.b64encode(encode_png(image, srgb=srgb)).decode()
    text = html.escape(caption)
    image_tag = f"<img width='{width}' src='data:image/png;base64,{data}' alt='{text}'>"
    return f"<figure style='width: {width}px'>{image_tag}<figcaption>{text}</figcaption></figure>"


def heat(values: np.ndarray, largest: float) -> np.ndarray:
    """(h, w, 3) colours of (h, w) values: black for 0, through red and yellow, to white for ``largest``."""
    share = np.clip(values / largest if largest > 0 else np.zeros_like(values), 0, 1)
    return np.stack([np.clip(3 * share - k, 0, 1) for k in range(3)], axis=-1)
