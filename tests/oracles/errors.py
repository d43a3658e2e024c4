"""Error estimates, pixel by pixel in plain Python."""

import math


def relative_error(variance, groups, image):
    """(value, low, high) of the relative RMSE by the formulas of ``error_estimate``'s head."""
    height, width = groups.shape
    known = {(y, x) for y in range(height) for x in range(width) if groups[y, x] > 1}
    v = {p: float(sum(variance[p])) for p in known}
    total = sum(v.values())
    mean = sum(float(c) for p in known for c in image[p]) / (3 * len(known))
    own = near = 0.0
    for y, x in known:
        k = int(groups[y, x])
        around = [
            v[y + i, x + j] for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0) and (y + i, x + j) in known
        ]
        own += 2 * v[y, x] ** 2 * k / (k + 1)
        near += 2 * v[y, x] * (sum(around) / len(around) if around else 0.0) * k / (k - 1)
    few = total**2 / sum(e * e for e in v.values())
    factor = math.exp(1.96 * (1 + 1 / math.sqrt(few)) * math.sqrt(max(own, near)) / total / 2)
    value = math.sqrt(total / (3 * len(known))) / mean
    return value, value / factor, value * factor
