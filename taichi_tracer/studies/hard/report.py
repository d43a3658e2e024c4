"""The result as one HTML page that needs no other file: tables, bars and leak maps."""

from html import escape

from taichi_tracer.files import page as pages
from taichi_tracer.studies import hard_cases
from taichi_tracer.studies.hard.catalogue import all_cases, all_renderer_cases
from taichi_tracer.studies.hard.modes import COUNTS, DEFAULT, INFORMATIVE

STYLE = """
td.text { text-align: left; white-space: normal; }
summary { cursor: pointer; } details { margin: 0.2em 0; }
.PASS { color: #1a7f37; } .FAIL { color: #cf222e; font-weight: 700; } .weak { color: #9a6700; }
"""
MAP_WIDTH = 320


def page(result) -> str:
    """The whole page."""
    verdict = "every mode keeps its promises" if result.passed else "a promise is broken"
    machine = ", ".join(f"{name} {value}" for name, value in result.machine.items())
    parts = [
        f"<p>Level “{escape(result.level)}”; {escape(machine)}.</p>",
        f"<p><b>{escape(hard_cases.default_line())}</b> The other modes are there for comparison.</p>",
        "<h2>Every mode</h2>",
        mode_table(result),
        *(f"<p>{escape(line)}</p>" for line in hard_cases.LEGEND),
        "<h2>Leaks at edges, per 1e6 rays</h2>",
        bars([(str(r.mode), r.per_million("edge_leaks", "edge_rays")) for r in result.rows], "#cf222e"),
        "<h2>Time of a ray with an accelerator, in ns</h2>",
        bars([(str(r.mode), r.ns_per_ray) for r in result.rows if r.mode.intersector != "brute_force"], "#0969da"),
        "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in hard_cases.ratios(result)) + "</ul>",
        "<h2>Leak maps</h2>",
        leak_maps(result),
        "<h2>Every case</h2>",
        case_table(result),
    ]
    return pages.page(f"Hard cases: {verdict}", parts, STYLE)


def mode_table(result) -> str:
    """What was found in each mode."""
    columns, rows = ["mode", *hard_cases.COLUMNS, "cases"], []
    for row in result.rows:
        words = [v.word for v in result.verdicts if v.mode == str(row.mode)]
        worst = "FAIL" if "FAIL" in words else "weak" if "weak" in words else "PASS"
        told = f"<span class='{worst}'>{words.count('PASS')} of {len(words)} PASS</span>"
        name = escape(str(row.mode))
        name = f"<b>{name} (default)</b>" if row.mode == DEFAULT else name
        cells = [name, *(escape(cell) for cell in hard_cases.cells(row)), told]
        rows.append(dict(zip(columns, cells, strict=True)))
    return pages.cards(rows, columns)


def case_table(result) -> str:
    """Every case: what goes wrong, and the verdict of each mode; one that is not PASS says what was found."""
    told = {case.name: type(case).__doc__ for case in [*all_cases(), *all_renderer_cases()]}
    rows = []
    for case in dict.fromkeys(v.case for v in result.verdicts):
        verdicts = [v for v in result.verdicts if v.case == case]
        good = sum(v.word == "PASS" for v in verdicts)
        marks = [f"<span class='PASS'>PASS</span> in {good} of {len(verdicts)} modes"]
        marks += [mark(v) for v in verdicts if v.word == "FAIL"]
        weak = [mark(v) for v in verdicts if v.word == "weak"]
        text = "<br>".join(escape(line) for line in (told.get(case) or "").strip().split("\n\n"))
        rows.append(
            f"<tr><td class='text'><b>{escape(case)}</b><br>{text}</td>"
            f"<td class='text'>{'<br>'.join(marks)}{folded(weak)}</td></tr>"
        )
    words = "PASS: nothing wrong. weak: wrong, and not promised by this mode. FAIL: a broken promise."
    return f"<p>{words}</p><table>{''.join(rows)}</table>"


def mark(verdict) -> str:
    """A verdict that is not PASS, with its mode and what was found."""
    names = [*verdict.broken, *verdict.weak]
    found = ", ".join(f"{what_of(n)} {verdict.findings[n]:.3g} of {verdict.rays:,}" for n in names)
    return f"<span class='{verdict.word}'>{verdict.word}</span> {escape(f'{verdict.mode}: {found}')}"


def folded(marks: list[str]) -> str:
    """Lines that a click unfolds: a reader who looks for failures need not pass the modes that promise nothing."""
    if not marks:
        return ""
    count = f"{len(marks)} mode{'s' * (len(marks) > 1)}"
    return f"<details><summary><span class='weak'>weak</span> in {count}</summary>{'<br>'.join(marks)}</details>"


def what_of(finding: str) -> str:
    """A finding's name in words."""
    known = COUNTS | INFORMATIVE
    return finding.replace("_", " ") if finding in known else f"relative error of {finding.replace('_', ', ')}"


def bars(values, colour: str) -> str:
    """A bar for each (name, number); one that was not measured is left out."""
    values = [(name, value) for name, value in values if value is not None and value == value]
    largest = max((value for _, value in values), default=0) or 1
    words = ["0" if v == 0 else f"{v:,.3g}" if v < 100 else f"{v:,.0f}" for _, v in values]
    rows = [(name, value / largest, number) for (name, value), number in zip(values, words, strict=True)]
    return pages.bars(rows, colour)


def leak_maps(result) -> str:
    """The pictures, those of one precision beside each other."""
    pictures = [row for row in result.rows if row.leak_map is not None]
    pictures.sort(key=lambda row: (row.mode.fast_math, row.mode.precision, row.mode.triangle_test))
    figures = []
    for row in pictures:
        caption = f"{row.mode}: {row.leaking_pixels:,} of {row.leak_map[..., 0].size:,} pixels are leaks"
        figures.append(pages.picture(row.leak_map, caption, MAP_WIDTH))
    told = (
        "A closed white sphere, lit from inside, in front of a red background: every red pixel is a ray that got out. "
        "The ray of each pixel is aimed at the point of an edge that is nearest to what the pixel shows, as exactly as "
        "f32 can say it; of rays through the pixels' centres, only a few in a million would meet an edge so closely."
    )
    return f"<p>{told}</p>{''.join(figures)}"
