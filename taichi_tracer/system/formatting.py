"""Numbers as text, for tables and messages."""

from collections.abc import Iterable


def digits(value: float, spec: str = "g") -> str:
    """``format(value, spec)``, where 0 has no sign: neither −0, nor a negative number that is rounded to 0."""
    text = format(value, spec)
    is_zero = "-" in text and value == value and not any(c in "123456789" for c in text) and abs(value) < 1
    return format(0.0, spec) if is_zero else text


def digits_of(values: Iterable[float], spec: str = "g") -> str:
    """Some numbers in brackets: "(x, y, z)"."""
    return "(" + ", ".join(digits(value, spec) for value in values) + ")"
