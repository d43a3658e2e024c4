"""What the pages of students and teachers share: the box of a part, its colours, and the frame of a page.

A notebook shows boxes, too. There the colours of a page are unknown, so lines and backgrounds are half transparent.
"""

import html
from collections.abc import Sequence

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.teaching.base import CRASHED, MISSING, NOT_WRITTEN, RIGHT, PartResult

WIDTH = 78  # columns of the line of a part in a terminal
SHOWN = 200  # pixels: the width of a picture
KINDS = {RIGHT: "right", NOT_WRITTEN: "open", MISSING: "open"}  # how a status is coloured; "wrong" for the others
STYLE = """
.teaching .right { color: var(--right, #2a9147); } .teaching .wrong { color: var(--wrong, #d9463b); }
.teaching .open { color: var(--open, #a37f00); } .teaching td, .teaching th { text-align: left; }
.teaching td { white-space: normal; font-variant-numeric: tabular-nums; }
.teaching td:first-child { white-space: nowrap; }
.teaching .part { border: 1px solid rgba(127, 127, 127, 0.4); border-radius: 6px; padding: .5em 1em; margin: .8em 0; }
.teaching .part h3 { margin: .2em 0; font-size: 1.05em; overflow-wrap: anywhere; } .teaching .part p { margin: .5em 0; }
.teaching .part code, .teaching pre { background: rgba(127, 127, 127, 0.15); padding: 0 3px; }
.teaching pre { padding: .6em; overflow-x: auto; }
.teaching .numbers { font: 13px ui-monospace, monospace; border-collapse: collapse; }
.teaching .numbers th, .teaching .numbers td { vertical-align: top; padding: 3px 9px; overflow-wrap: anywhere; }
.teaching figure { display: inline-block; margin: 0 10px 10px 0; }
.teaching .part figure { max-width: calc(33% - 10px); }
.teaching figcaption { max-width: 100%; overflow-wrap: anywhere; }
.teaching img { image-rendering: pixelated; max-width: 100%; }
"""
PAGE_STYLE = f"""
:root {{ --right: #1a7f37; --wrong: #b42318; --open: #8a6d00; --bar: #3f6fb5; --link: #1a56a8; }}
@media (prefers-color-scheme: dark) {{
  :root {{ --right: #57c278; --wrong: #ff8a7a; --open: #e0b84d; --bar: #6f9fe0; --link: #8ab8f5; }}
}}
a {{ color: var(--link); }} h1, h2 {{ overflow-wrap: anywhere; }}
{STYLE}"""


def whole(title: str, parts: Sequence[str], style: str = "") -> str:
    """A document of HTML; ``style`` is added to that of the boxes."""
    return page.page(title, ["<div class='teaching'>", *parts, "</div>"], PAGE_STYLE + style)


def in_notebook(parts: Sequence[str]) -> str:
    """Boxes within a page that is not ours."""
    return f"<style>{STYLE}</style><div class='teaching'>{''.join(parts)}</div>"


def coloured(status: str, content: str) -> str:
    """HTML in the colour of a status, which the mouse names."""
    return f"<span class='{KINDS.get(status, 'wrong')}' title='{html.escape(status)}'>{content}</span>"


def lines_of(name: str, points: float, verdict: PartResult, seconds: float) -> list[str]:
    """What a terminal shows of one part, which is worth so many points: the verdict, with the first wrong numbers."""
    head = f"  {verdict.status:<12}{name:<36}{points * verdict.share:>5.3g} of {points:<4g}"
    said = [f"      {verdict.message}"] * bool(verdict.message)
    for whose, values in verdict.first_wrong.items() if said else ():
        said.append(f"      {whose:<6}" + "  ".join(f"{name} = {value}" for name, value in values.items()))
    return [f"{head:<{WIDTH - 8}}{seconds:>6.1f} s", *(said if verdict.status != RIGHT else ())]


def box(name: str, facts: str, verdict: PartResult, found: Sequence[str] = (), hint: str = "") -> str:
    """One part.

    Args:
        facts: a line about points and time.
        found: what is probably wrong, a sentence each.
    """
    head = f"{coloured(verdict.status, html.escape(verdict.status))} <code>{html.escape(name)}</code>"
    if verdict.status == CRASHED and not verdict.message:
        return f"<p>{head}, {html.escape(facts)}: for the same reason</p>"
    lines = [f"<div class='part'><h3>{head}</h3>", page.paragraph(facts, "note")]
    lines += [page.paragraph(verdict.message)] * bool(verdict.message)
    wrong = {whose: ", ".join(f"{n} = {v}" for n, v in values.items()) for whose, values in verdict.first_wrong.items()}
    rows = (f"<tr><th>{html.escape(whose)}</th><td>{html.escape(text)}</td></tr>" for whose, text in wrong.items())
    lines += [f"<div class='wide'><table class='numbers'>{''.join(rows)}</table></div>"] * bool(wrong)
    lines += [*map(page.paragraph, found), *[page.paragraph(f"Hint: {hint}", "note")] * bool(hint)]
    lines += [page.picture(np.clip(image, 0, 1), called, SHOWN) for called, image in verdict.pictures.items()]
    return "".join(lines) + "</div>"
