"""Lamps in proportion to a fixed weight: their area (A3-2), or their power. A binary search finds the lamp."""

import numpy as np
import taichi as ti

from taichi_tracer.lights.choice import LampChoice, LampTable
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.registry import register
from taichi_tracer.system.seams import seams


@ti.data_oriented
@seams("weights")
class ByWeight(LampChoice):
    """A lamp is chosen with the probability weight / sum of all weights. A subclass defines ``weights``.

    The cumulative distribution is built in float64 and then rounded. The probability of a lamp is the difference of two
    rounded values, so that it is exactly the probability with which the lamp is chosen.
    """

    def weights(self, lamps: LampTable) -> np.ndarray:
        """(L,) weights ≥ 0."""
        raise NotImplementedError(f"{type(self).__name__} must say what weights the lamps have")

    def prepare(self, lamps: LampTable) -> None:
        """Build the cumulative distribution. If all weights are 0, all lamps are equally likely."""
        weights = self.weights(lamps)
        largest = weights.max()
        weights = weights / largest if 0 < largest < np.inf else np.ones(len(lamps))
        cdf = np.concatenate([[0], np.cumsum(weights)])
        self.count = len(lamps)
        self._memory = memory.Memory()
        self.cdf = ti.field(float)
        self._memory.fields.dense(ti.i, self.count + 1).place(self.cdf)
        self._memory.allocate()
        self._load((cdf / cdf[-1]).astype(runtime.dtype()))

    @ti.kernel
    def _load(self, cdf: ti.types.ndarray(ndim=1)):
        for i in self.cdf:
            self.cdf[i] = cdf[i]

    @ti.func
    def choose(self, x, n, xi):
        """(lamp, probability): the lamp whose interval of the cumulative distribution contains ξ."""
        low, high = 0, self.count
        while high - low > 1:
            middle = (low + high) >> 1
            if self.cdf[middle] <= xi:
                low = middle
            else:
                high = middle
        return low, self.probability(x, n, low)

    @ti.func
    def probability(self, x, n, lamp):
        """The share of the lamp in the sum of all weights."""
        return self.cdf[lamp + 1] - self.cdf[lamp]


@register
@ti.data_oriented
@seams("weights")
class ByArea(ByWeight):
    """In proportion to the area, whatever the lamp emits: the course's sampling (A3-2)."""

    name = "area"

    def weights(self, lamps: LampTable) -> np.ndarray:
        """The areas."""
        return lamps.areas


@register
@ti.data_oriented
@seams("weights")
class ByPower(ByWeight):
    """In proportion to area × luminance: bright lamps get more samples than dark lamps of the same size."""

    name = "power"

    def weights(self, lamps: LampTable) -> np.ndarray:
        """Area × luminance."""
        return lamps.areas * lamps.radiance
