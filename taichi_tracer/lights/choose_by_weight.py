"""Lamps in proportion to a fixed weight: their area (A3-2), or their power. A binary search finds the lamp."""

import numpy as np
import taichi as ti

from taichi_tracer.lights.choice import LampChoice, LampTable
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import filled, varying
from taichi_tracer.system.parts import overridable, register

CELLS = 1 << 24  # a random number in f32 is a multiple of 1/CELLS


@ti.data_oriented
@overridable("weights")
class ByWeight(LampChoice):
    """A lamp is chosen with the probability weight / sum of all weights. A subclass defines ``weights``.

    The cumulative distribution consists of multiples of 2⁻²⁴, as the random numbers of f32 do. Therefore the difference
    of two values is exactly the probability with which a lamp is chosen, and no lamp with a weight is left out, however
    small its share is.
    """

    def weights(self, lamps: LampTable) -> np.ndarray:
        """(L,) weights ≥ 0."""
        raise NotImplementedError(f"{type(self).__name__} must say what weights the lamps have")

    def prepare(self, lamps: LampTable) -> None:
        """Build the cumulative distribution. If all weights are 0, all lamps are equally likely."""
        self.count = varying(len(lamps))
        cdf = np.concatenate([[0], np.cumsum(cells_of(self.weights(lamps)))]) / CELLS
        self._memory, (self.cdf,) = filled(cdf)

    @ti.func
    def choose(self, x, n, xi):
        """(lamp, probability, rest): the lamp whose interval of the cumulative distribution contains ξ."""
        low, high = 0, self.count
        while high - low > 1:
            middle = (low + high) >> 1
            if self.cdf[middle] <= xi:
                low = middle
            else:
                high = middle
        probability = self.probability(x, n, low)
        return low, probability, (xi - self.cdf[low]) / probability

    @ti.func
    def probability(self, x, n, lamp):
        """The share of the lamp in the sum of all weights."""
        return self.cdf[lamp + 1] - self.cdf[lamp]


def cells_of(weights: np.ndarray) -> np.ndarray:
    """(L,) int64 with the sum ``CELLS``, in proportion to the weights, but at least 1 where a weight is above 0.

    Raises:
        InputError: there are more weights than cells.
    """
    count = len(weights)
    if count > CELLS // 2:
        raise InputError(f"{count:,} surfaces emit light: more than {CELLS // 2:,} need the lamp choice 'hierarchy'")
    largest = weights.max()
    shares = weights / largest if 0 < largest < np.inf else np.ones(count)
    cells = np.maximum(np.floor(shares / shares.sum() * (CELLS - count)), shares > 0).astype(np.int64)
    cells[shares.argmax()] += CELLS - cells.sum()  # what rounding left over is at most one cell per lamp
    return cells


@register
@ti.data_oriented
@overridable("weights")
class ByArea(ByWeight):
    """In proportion to the area, whatever the lamp emits: the course's sampling (A3-2)."""

    name, keeps_area = "area", True

    def weights(self, lamps: LampTable) -> np.ndarray:
        """The areas."""
        return lamps.areas


@register
@ti.data_oriented
@overridable("weights")
class ByPower(ByWeight):
    """In proportion to area × luminance: bright lamps get more samples than dark lamps of the same size."""

    name = "power"

    def weights(self, lamps: LampTable) -> np.ndarray:
        """Area × luminance."""
        return lamps.areas * lamps.radiance
