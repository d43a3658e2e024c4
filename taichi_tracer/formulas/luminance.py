"""How bright a colour is, where random choices are made in proportion to light."""

import numpy as np

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (ITU-R BT.709)
# A saturated colour can have almost no luminance and still be light. A colour therefore counts with at least this
# fraction of its largest component, so that everything that shines is sampled.
LEAST_SHARE = 1e-3


def luminance(colors: np.ndarray) -> np.ndarray:
    """(..., 3) linear colours → (...) float64, positive where any component is."""
    return np.maximum(colors.astype(np.float64) @ LUMINANCE, colors.max(axis=-1, initial=0) * LEAST_SHARE)
