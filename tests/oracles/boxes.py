"""Where rays are inside boxes whose sides are parallel to the axes, in rational numbers."""

from fractions import Fraction

INFINITY = float("inf")


def interval(origin, direction, low, high):
    """(t_near, t_far) of the line in the box; None where it misses. The border belongs to the box."""
    near, far = -INFINITY, INFINITY
    for o, d, lowest, highest in zip(origin, direction, low, high, strict=True):
        o, d, lowest, highest = (Fraction(float(x)) for x in (o, d, lowest, highest))
        if d == 0:
            if not lowest <= o <= highest:
                return None
            continue
        first, second = sorted(((lowest - o) / d, (highest - o) / d))
        near, far = max(near, first), min(far, second)
    return (near, far) if near <= far else None
