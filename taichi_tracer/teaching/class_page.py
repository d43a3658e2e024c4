"""Pages of HTML for the teacher: one of the class, and one of each student. They need no other file and no network."""

import html
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.files.disk import replace_file
from taichi_tracer.teaching import boxes
from taichi_tracer.teaching.base import CRASHED, RIGHT, STATUSES, Assignment, PartResult
from taichi_tracer.teaching.grade import GradingSettings, pictures_of
from taichi_tracer.teaching.marks import Mark, most_points
from taichi_tracer.teaching.submissions import Submission

THUMBNAIL = 96  # pixels: of a picture on the page of the class
MOST_SMALL = 60  # pictures of one part on the page of the class
MOST_SLOWEST = 10  # submissions on the list of the slowest
BINS = 10  # of the distribution
MEANING = "right: all points; wrong: points by the share of right inputs; the others: none"
STYLE = """
.bad img { outline: 2px solid var(--wrong); } .tall { vertical-align: bottom; }
.tall span { writing-mode: vertical-rl; transform: rotate(180deg); }
svg text { fill: var(--ink); font: 15px system-ui, sans-serif; } svg rect { fill: var(--bar); }
svg line { stroke: var(--grid); }
"""


def write(
    folder: Path,
    assignment: Assignment,
    found: Sequence[Submission],
    marks: Sequence[Mark],
    settings: GradingSettings,
) -> Path:
    """Write index.html and a page for each student below a folder; returns the path of index.html."""
    (folder / "students").mkdir(parents=True, exist_ok=True)
    files = file_names(marks)
    small: dict[str, list[tuple[Mark, np.ndarray, np.ndarray]]] = {}
    for mark, submitted in zip(marks, found, strict=True):
        pictures = pictures_of(assignment, submitted, settings.seed)
        content = student_page(assignment, mark, pictures)
        replace_file(folder / "students" / files[mark.key], content.encode())
        for part, images in pictures.items():
            if len(small.setdefault(part, [])) < MOST_SMALL:
                small[part].append((mark, thumbnail(images["yours"]), thumbnail(images["right"])))
    index = folder / "index.html"
    replace_file(index, class_page(assignment, marks, files, small, settings).encode())
    return index


def file_names(marks: Sequence[Mark]) -> dict[str, str]:
    """Key → the name of the student's page; letters that a path or a link may not have are replaced."""
    names: dict[str, str] = {}
    for mark in marks:
        plain = re.sub(r"[^A-Za-z0-9_-]+", "_", mark.key.removesuffix(".zip"))[:60] or "_"
        name, number = plain, 2
        while f"{name}.html".casefold() in (used.casefold() for used in names.values()):
            name, number = f"{plain}_{number}", number + 1
        names[mark.key] = f"{name}.html"
    return names


def thumbnail(image: np.ndarray) -> np.ndarray:
    """Every k-th pixel of a picture, so that its width is not much more than ``THUMBNAIL``."""
    step = max(1, image.shape[1] // THUMBNAIL)
    return image[::step, ::step]


# ── one student ──


def student_page(assignment: Assignment, mark: Mark, pictures: dict[str, dict[str, np.ndarray]]) -> str:
    """The page that a student may read: each part, what is wrong, and what it may come from."""
    parts = [summary_of(mark)]
    if mark.refused:
        parts.append(f"<p class='wrong'>This submission was not unpacked: {html.escape(mark.refused)}</p>")
    notes = [*mark.notes, *(f"The rule of imports: {text}" for text in mark.imports)]
    if notes:
        parts.append("<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in notes) + "</ul>")
    parts.append(overview(mark))
    said = {part.message: part.name for part in reversed(mark.parts) if part.status == CRASHED}  # by which part first
    wrong = [part for part in mark.parts if part.status != RIGHT]
    once = [part if said.get(part.message, part.name) == part.name else replace(part, message="") for part in wrong]
    parts += [part_box(part, pictures.get(part.name, {})) for part in once]
    if mark.printed.strip():
        parts.append(f"<h2>What it printed</h2><pre>{html.escape(mark.printed)}</pre>")
    parts.append(page.paragraph(f"Walls around the submission: {mark.level}.", "note"))
    return boxes.whole(f"{assignment.title}: {mark.student}", parts)


def summary_of(mark: Mark) -> str:
    """The score in one line."""
    text = f"{mark.score:g} of {mark.points:g} points; {mark.right} of {len(mark.parts)} parts are right"
    return f"<p><strong>{html.escape(text)}</strong></p>"


def overview(mark: Mark) -> str:
    """A row for each part."""
    rows = "".join(
        f"<tr><td>{html.escape(part.name)}</td><td class='{boxes.kind_of(part.status)}'>"
        f"{html.escape(part.status)}</td><td>{part.earned:g} of {part.points:g}</td><td>{html.escape(part.topic)}</td>"
        f"<td>{part.seconds:.1f}</td></tr>"
        for part in mark.parts
    )
    return headed(["part", "status", "points", "topic", "seconds"], rows)


def part_box(part: PartResult, pictures: dict[str, np.ndarray]) -> str:
    """One part that is not right."""
    facts = f"{part.earned:g} of {part.points:g} points, {part.topic}"
    hint = part.findings[0]["hint"] if part.findings else ""
    found = [finding["text"] for finding in part.findings]
    return boxes.box(part.name, facts, replace(part, pictures=pictures), found, hint)


# ── the class ──


def class_page(
    assignment: Assignment,
    marks: Sequence[Mark],
    files: dict[str, str],
    small: dict[str, list[tuple[Mark, np.ndarray, np.ndarray]]],
    settings: GradingSettings,
) -> str:
    """The page of the class."""
    scores = np.array([mark.score for mark in marks])
    middle = f"mean {scores.mean():.3g}, median {np.median(scores):.3g}, of {most_points(marks):g} points"
    parts = [
        page.paragraph(f"{len(marks)} submissions; {middle}."),
        "<h2>Distribution of the scores</h2>",
        histogram(scores, most_points(marks)),
        "<h2>Parts</h2>",
        page.paragraph(MEANING, "note"),
        parts_table(marks),
        "<h2>Most frequent mistakes</h2>",
        mistakes_table(marks, files),
        "<h2>Students</h2>",
        students_table(marks, files),
        "<h2>Slowest parts</h2>",
        slowest_table(marks, files),
        *(row_of_pictures(name, entries) for name, entries in small.items()),
        page.paragraph(f"Walls around each submission: {settings.level}. Seed of the inputs: {settings.seed}.", "note"),
    ]
    return boxes.whole(f"{assignment.title}: the class", parts, STYLE)


def histogram(scores: np.ndarray, points: float) -> str:
    """Bars: how many submissions have how many points."""
    counts, edges = np.histogram(scores, BINS, (0, max(points, 1e-9)))
    width, height, gap = 60, 150, 6
    most = max(1, counts.max())
    drawn = []
    for i, count in enumerate(counts):
        tall = round(height * count / most)
        x = i * width
        drawn.append(f"<rect x='{x + gap / 2}' y='{height - tall + 20}' width='{width - gap}' height='{tall}'/>")
        if count:
            drawn.append(f"<text x='{x + width / 2}' y='{height - tall + 14}' text-anchor='middle'>{count}</text>")
    for i, edge in enumerate(edges):
        at, anchor = i * width, "start" if i == 0 else "end" if i == BINS else "middle"
        drawn.append(f"<text x='{at}' y='{height + 38}' text-anchor='{anchor}'>{edge:.3g}</text>")
    base = f"<line x1='0' x2='{BINS * width}' y1='{height + 20}' y2='{height + 20}'/>"
    size = f"viewBox='0 0 {BINS * width} {height + 62}' width='{BINS * width}' role='img'"
    below = f"<text x='{BINS * width / 2}' y='{height + 57}' text-anchor='middle'>points</text>"
    return f"<svg {size} aria-label='distribution of the scores'>{''.join(drawn)}{base}{below}</svg>"


def parts_table(marks: Sequence[Mark]) -> str:
    """How each part went in the class."""
    rows = []
    for i, first in enumerate(marks[0].parts):
        statuses = Counter(mark.parts[i].status for mark in marks)
        mean = np.mean([mark.parts[i].share for mark in marks])
        points = max(mark.parts[i].points for mark in marks)
        row = {"part": first.name, "topic": first.topic, "points": f"{points:g}", "mean": f"{mean:.0%}"}
        rows.append(row | {status: statuses.get(status, "") for status in STATUSES})
    return page.table(rows, ["part", "topic", "points", "mean", *STATUSES])


def mistakes_table(marks: Sequence[Mark], files: dict[str, str]) -> str:
    """Which known mistakes were made how often, and by whom; mistakes that give the same numbers count together."""
    who: dict[tuple[str, str, str], list[Mark]] = {}
    for mark in marks:
        for part in mark.parts:
            named = [finding for finding in part.findings if finding["names"]]
            if named:
                text = ", or ".join(" and ".join(finding["names"]) for finding in named)
                who.setdefault((part.name, text, str(named[0]["topic"])), []).append(mark)
    if not who:
        return page.paragraph("No known mistake was found.")
    ordered = sorted(who.items(), key=lambda entry: (-len(entry[1]), entry[0]))
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td><td>{len(made)}</td><td>{html.escape(part)}</td>"
        f"<td>{html.escape(topic)}</td><td>{', '.join(link(mark, files) for mark in made)}</td></tr>"
        for (part, name, topic), made in ordered
    )
    return headed(["mistake", "students", "part", "topic", "by"], rows)


def students_table(marks: Sequence[Mark], files: dict[str, str]) -> str:
    """One row for each submission."""
    names = [part.name for part in marks[0].parts]
    rows = []
    for mark in marks:
        cells = "".join(
            f"<td class='{boxes.kind_of(part.status)}' title='{html.escape(f'{part.name}: {part.status}')}'>"
            f"{part.earned:g}</td>"
            for part in mark.parts
        )
        told = [mark.refused] * bool(mark.refused)
        told += [f"imports: {text}" for text in mark.imports]
        rows.append(
            f"<tr><td>{link(mark, files)}</td><td><strong>{mark.score:g}</strong></td>{cells}"
            f"<td>{html.escape('; '.join(told))}</td></tr>"
        )
    short = [name.rpartition(".")[2] for name in names]
    head = "".join(f"<th class='tall'><span>{html.escape(name)}</span></th>" for name in short)
    head = f"<th>student</th><th>score</th>{head}<th>remarks</th>"
    return page.sortable(head, "".join(rows))


def slowest_table(marks: Sequence[Mark], files: dict[str, str]) -> str:
    """The parts that took longest, with compilation."""
    entries = [(part.seconds, mark, part) for mark in marks for part in mark.parts]
    entries.sort(key=lambda entry: (-entry[0], entry[1].key, entry[2].name))
    rows = "".join(
        f"<tr><td>{html.escape(part.name)}</td><td>{seconds:.1f}</td><td>{html.escape(part.status)}</td>"
        f"<td>{link(mark, files)}</td></tr>"
        for seconds, mark, part in entries[:MOST_SLOWEST]
    )
    return headed(["part", "seconds", "status", "student"], rows)


def row_of_pictures(name: str, entries: list[tuple[Mark, np.ndarray, np.ndarray]]) -> str:
    """The pictures of a part side by side: the right one first, wrong ones with a frame."""
    figures = [page.picture(entries[0][2], "right", THUMBNAIL)]
    for mark, image, _ in entries:
        is_right = next(part.status for part in mark.parts if part.name == name) == RIGHT
        figures.append(
            f"<span class='{'' if is_right else 'bad'}'>{page.picture(image, mark.student, THUMBNAIL)}</span>"
        )
    return f"<h2>{html.escape(name)}</h2>" + "".join(figures)


def link(mark: Mark, files: dict[str, str]) -> str:
    """A link to a student's page."""
    return f"<a href='students/{files[mark.key]}'>{html.escape(mark.student)}</a>"


def headed(columns: Sequence[str], rows: str) -> str:
    """A table of rows that are HTML already."""
    return page.sortable("".join(f"<th>{html.escape(column)}</th>" for column in columns), rows)
