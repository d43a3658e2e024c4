"""Error estimates, pixel by pixel in plain Python."""

import math

from scipy import stats


def relative_error(variance, groups, image, unseen=0.0, of_largest=None):
    """(value, low, high) of the relative RMSE by the formulas of ``error_estimate``'s head."""
    height, width = groups.shape
    known = [(y, x) for y in range(height) for x in range(width) if groups[y, x] > 1]
    v = [float(sum(variance[p])) for p in known]
    mean = sum(float(c) for p in known for c in image[p]) / (3 * len(known))
    value, factor = math.sqrt(sum(v) / (3 * len(known))) / mean, interval(v)
    high = value * factor
    w = v
    if of_largest is not None:
        w = [max(one, 3 * (0.5 * float(of_largest[p])) ** 2) for one, p in zip(v, known, strict=True)]
        high = max(high, math.sqrt(sum(w) / (3 * len(known))) / mean * interval(w))
    delta = math.sqrt(sum(w) / 3) / len(known) / mean
    return value, value / factor / (1 + 2 * delta), math.sqrt(high**2 + unseen**2) / (1 - 2 * delta)


def interval(v):
    """The root of the 0.975 quantile of the F-distribution for the variances v."""
    nu = sum(v) ** 2 / sum(e * e for e in v)
    return math.sqrt(stats.f.ppf(0.975, 2 * nu, 2 * nu))
