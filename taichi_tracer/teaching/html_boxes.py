"""What the pages of students and teachers share: the box of a part, its colours, and the frame of a page.

A notebook shows boxes, too. There the colours of a page are unknown, so lines and backgrounds are half transparent.
"""

import html
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.teaching.base import CRASHED, DIGITS, MISSING, NOT_WRITTEN, RIGHT, PartResult

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


def coloured(status: str, content: str) -> str:
    """HTML in the colour of a status, which the mouse names."""
    return f"<span class='{KINDS.get(status, 'wrong')}' title='{html.escape(status)}'>{content}</span>"


def lines_of(result: PartResult) -> list[str]:
    """What a terminal shows of one part: its status, the first wrong numbers, and what is probably wrong."""
    head = f"  {result.status:<12}{result.name:<36}{result.earned:>5g} of {result.points:<4g}"
    said = [f"      {result.message}"] * bool(result.message)
    for whose, values in result.first_wrong.items() if said else ():
        said.append(f"      {whose:<6}" + "  ".join(f"{name} = {value}" for name, value in values.items()))
    said += [f"      {finding['text']}" for finding in result.findings]
    said += [f"      hint: {finding['hint']}" for finding in result.findings[:1] if finding["hint"]]
    return [f"{head:<{WIDTH - 8}}{result.seconds:>6.1f} s", *(said if result.status != RIGHT else ())]


def box(result: PartResult) -> str:
    """One part: its points, the first wrong numbers, what is probably wrong, and its pictures."""
    head = f"{coloured(result.status, html.escape(result.status))} <code>{html.escape(result.name)}</code>"
    facts = f"{result.earned:g} of {result.points:g} points" + f", {result.topic}" * bool(result.topic)
    lines = [f"<div class='part'><h3>{head}</h3>", page.paragraph(facts, "note")]
    if result.status == RIGHT:
        return "".join(lines) + "</div>"
    lines.append(page.paragraph(result.message or "for the same reason"))
    wrong = {whose: ", ".join(f"{n} = {v}" for n, v in values.items()) for whose, values in result.first_wrong.items()}
    rows = (f"<tr><th>{html.escape(whose)}</th><td>{html.escape(text)}</td></tr>" for whose, text in wrong.items())
    lines += [f"<div class='wide'><table class='numbers'>{''.join(rows)}</table></div>"] * bool(wrong)
    lines += [page.paragraph(finding["text"]) for finding in result.findings]
    lines += [page.paragraph(f"Hint: {finding['hint']}", "note") for finding in result.findings[:1] if finding["hint"]]
    lines += [page.picture(np.clip(image, 0, 1), called, SHOWN) for called, image in result.pictures.items()]
    return "".join(lines) + "</div>"


@dataclass
class Report:
    """The results of a check. ``print`` shows it as text, and a notebook as a page.

    Attributes:
        title: of the assignment. notes: warnings that came while the parts ran.
    """

    title: str
    results: list[PartResult] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def points(self) -> float:
        """The points of all parts that were checked."""
        return round(sum(result.earned for result in self.results), DIGITS)

    @property
    def is_right(self) -> bool:
        """Whether every part that was checked is right."""
        return all(result.status == RIGHT for result in self.results)

    def score(self) -> float:
        """The points, for nbgrader.

        Raises:
            AssertionError: none were earned. nbgrader would take the number 0 for all points.
        """
        if not self.points > 0:
            raise AssertionError(self.results[0].message if self.results else self.summary())
        return self.points

    def summary(self) -> str:
        """One line."""
        right, of = sum(r.status == RIGHT for r in self.results), sum(r.points for r in self.results)
        return f"{right} of {len(self.results)} parts are right: {self.points:g} of {of:g} points"

    def shown(self) -> list[PartResult]:
        """The results; what is wrong with a file is said once."""
        first = {one.message: one.name for one in reversed(self.results) if one.status == CRASHED}
        again = [one.message in first and one.name != first[one.message] for one in self.results]
        return [replace(one, message="") if said else one for one, said in zip(self.results, again, strict=True)]

    def __str__(self) -> str:
        lines = [line for result in self.shown() for line in lines_of(result)]
        notes = [f"note: {text}" for text in self.notes]
        return "\n".join([self.title, *lines, *notes, self.summary()])

    __repr__ = __str__

    def body(self) -> list[str]:
        """The page without its frame."""
        notes = [page.paragraph(f"note: {text}", "note") for text in self.notes]
        return [page.paragraph(self.summary()), *notes, *map(box, self.shown())]

    def page(self) -> str:
        """A whole document of HTML."""
        return whole(self.title, self.body())

    def _repr_html_(self) -> str:
        return f"<style>{STYLE}</style><div class='teaching'>{''.join(self.body())}</div>"
