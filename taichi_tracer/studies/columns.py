"""Tables for a terminal."""

from collections.abc import Sequence


def in_columns(rows: Sequence[dict[str, str]]) -> list[str]:
    """Rows as lines in which each column has the same width, below the names of the columns; nothing for no rows."""
    lines = [list(row.values()) for row in rows]
    if lines:
        lines.insert(0, list(rows[0]))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip() for line in lines]
