"""The result as one HTML page that needs no other file."""

from taichi_tracer.files import page as pages
from taichi_tracer.studies import hard_cases


def page(result: "hard_cases.SuiteResult") -> str:
    """The whole page: the verdict on the default, every mode, every case, and what other modes lose."""
    modes, cases = hard_cases.mode_rows(result), hard_cases.case_rows(result)
    machine = ", ".join(f"{name} {value}" for name, value in result.machine.items())
    parts = [pages.paragraph(f"Level {result.level}; {machine}.", "note")]
    for title, rows in (("Every mode", modes), ("Every case in the default mode", cases)):
        parts += [f"<h2>{title}</h2>", pages.table(rows, list(rows[0])) if rows else ""]
    parts += [pages.paragraph(line, "note") for line in hard_cases.LEGEND]
    parts += ["<h2>What other modes lose</h2>", *map(pages.paragraph, hard_cases.losses(result))]
    return pages.page(hard_cases.default_line(result), parts, "td { white-space: normal; }")
