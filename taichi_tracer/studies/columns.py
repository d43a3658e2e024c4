"""Tables for a terminal."""

from collections.abc import Sequence


def in_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of text, of which the first names the columns, as lines in which each column has the same width."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def with_head(rows: Sequence[dict[str, str]]) -> list[Sequence[str]]:
    """The names of the columns, and the rows."""
    return [list(rows[0]), *(list(row.values()) for row in rows)] if rows else []
