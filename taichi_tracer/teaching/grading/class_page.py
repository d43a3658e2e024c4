"""Pages of HTML for the teacher: one of the class, and one of each student. They need no other file and no network."""

import html
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.files.disk import replace_file
from taichi_tracer.teaching import html_boxes
from taichi_tracer.teaching.base import STATUSES, Assignment
from taichi_tracer.teaching.grading.grade import GradingSettings, Mark, most_points
from taichi_tracer.teaching.html_boxes import Report

BINS = 10  # of the distribution
STYLE = """
.students th { writing-mode: vertical-rl; max-height: 16em; }
"""


def write(folder: Path, assignment: Assignment, marks: Sequence[Mark], settings: GradingSettings) -> Path:
    """Write index.html and a page for each student below a folder; returns the path of index.html."""
    (folder / "students").mkdir(parents=True, exist_ok=True)
    links: dict[str, str] = {}
    for i, mark in enumerate(marks):
        name = re.sub(r"[^A-Za-z0-9_-]+", "_", mark.key.removesuffix(".zip"))[:60]
        file = f"students/{name}-{i + 1}.html"  # the number tells apart what letters are replaced in
        replace_file(folder / file, student_page(assignment, mark).encode())
        links[mark.key] = f"<a href='{file}'>{html.escape(mark.student)}</a>"
    replace_file(folder / "index.html", class_page(assignment, marks, links, settings).encode())
    return folder / "index.html"


# ── one student ──


def student_page(assignment: Assignment, mark: Mark) -> str:
    """The page that a student may read: each part, what is wrong, and what it may come from."""
    report = Report(f"{assignment.title}: {mark.student}", list(mark.parts))
    remarks = html.escape("\n".join(mark.remarks))
    return html_boxes.whole(report.title, [f"<pre>{remarks}</pre>" if remarks else "", *report.body()])


# ── the class ──


def class_page(
    assignment: Assignment, marks: Sequence[Mark], links: Mapping[str, str], settings: GradingSettings
) -> str:
    """The page of the class.

    Args:
        links: key of a mark → a link to the student's page.
    """
    scores, most = [mark.score for mark in marks], most_points(marks)
    sums = f"mean {np.mean(scores):.3g}, median {np.median(scores):.3g}, of {most:g} points."
    worth = "right: all points; wrong: points by the share of right inputs; the others: none"
    run = f"Isolation of each submission: {settings.level}. Seed of the inputs: {settings.seed}."
    content = [
        page.paragraph(f"{len(marks)} submissions; {sums}"),
        "<h2>Distribution of the scores</h2>",
        distribution(scores, most),
        "<h2>Parts</h2>",
        page.paragraph(worth, "note"),
        parts_table(marks),
        "<h2>Most frequent mistakes</h2>",
        mistakes_table(marks, links),
        f"<h2>Students</h2> <div class='students'>{students_table(marks, links)}</div>",
        page.paragraph(run, "note"),
    ]
    return html_boxes.whole(f"{assignment.title}: the class", content, STYLE)


def distribution(scores: Sequence[float], points: float) -> str:
    """Bars: how many submissions have how many points."""
    counts, edges = np.histogram(scores, BINS, (0, max(points, 1e-9)))
    return page.bars(
        [
            (f"{low:.3g} to {high:.3g}", count / counts.max(), str(count))
            for low, high, count in zip(edges, edges[1:], counts, strict=False)
        ],
        "var(--bar)",
    )


def parts_table(marks: Sequence[Mark]) -> str:
    """How each part went in the class."""
    rows = []
    for results in zip(*(mark.parts for mark in marks), strict=True):
        mean, points = np.mean([part.share for part in results]), max(part.points for part in results)
        row = {"part": results[0].name, "topic": results[0].topic, "points": f"{points:g}", "mean": f"{mean:.0%}"}
        rows.append(row | Counter(part.status for part in results))
    return page.table(rows, ["part", "topic", "points", "mean", *STATUSES])


def mistakes_table(marks: Sequence[Mark], links: Mapping[str, str]) -> str:
    """Which known mistakes were made how often, and by whom."""
    who: dict[tuple[str, str, str], list[str]] = {}
    for mark in marks:
        for part in mark.parts:
            named = ", or ".join(name for finding in part.findings for name in finding["names"])
            if named:
                who.setdefault((named, part.name, part.topic), []).append(links[mark.key])
    rows = []
    for key, by in sorted(who.items(), key=lambda entry: (-len(entry[1]), entry[0])):
        cells = dict(zip(("mistake", "part", "topic"), map(html.escape, key), strict=True))
        rows.append(cells | {"students": str(len(by)), "by": ", ".join(by)})
    table = page.cards(rows, ["mistake", "students", "part", "topic", "by"])
    return table if rows else page.paragraph("No known mistake was found.")


def students_table(marks: Sequence[Mark], links: Mapping[str, str]) -> str:
    """One row for each submission."""
    rows = []
    for mark in marks:
        cells = {part.name: html_boxes.coloured(part.status, f"{part.earned:g}") for part in mark.parts}
        head = {"student": links[mark.key], "score": f"<strong>{mark.score:g}</strong>"}
        rows.append({**head, **cells, "remarks": html.escape(mark.refused)})
    return page.cards(rows, list(rows[0]))
