"""Error estimates, pixel by pixel in plain Python."""

import math

from scipy import stats


def relative_error(variance, groups, image, unseen=0.0):
    """(value, low, high) of the relative RMSE by the formulas of ``error_estimate``'s head."""
    height, width = groups.shape
    known = [(y, x) for y in range(height) for x in range(width) if groups[y, x] > 1]
    v = [float(sum(variance[p])) for p in known]
    mean = sum(float(c) for p in known for c in image[p]) / (3 * len(known))
    value = math.sqrt(sum(v) / (3 * len(known))) / mean
    nu = sum(v) ** 2 / sum(e * e for e in v)
    factor = math.sqrt(stats.f.ppf(0.975, 2 * nu, 2 * nu))
    return value, value / factor, math.sqrt((value * factor) ** 2 + unseen**2)
