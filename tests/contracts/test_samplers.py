"""Every registered sampler keeps the contract of ``sampler.Sampler``; those that break it in one point are found."""

import pytest
import taichi as ti
import taichi.math as tm
from support import DEBUG, start

from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import samplers
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.samplers.sobol import SobolSampler

pytestmark = pytest.mark.skipif(
    DEBUG,
    reason="with bounds checked, Taichi prints a line for every product of words that overflows: those of a hash do",
)


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


@every("sampler")
def test_sampler(part):
    samplers.check_sampler(part)


@ti.data_oriented
class RepeatsADimension(IndependentSampler):
    """Dimension 63 is dimension 5 again."""

    name = "broken: a dimension twice"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        return IndependentSampler.get_2d(self, seed, pixel, index, ti.select(dimension == 63, ti.u32(5), dimension))


@ti.data_oriented
class ShiftsADimension(SobolSampler):
    """Dimension 40 is dimension 3 plus 1/4: by itself it is as even as it should be."""

    name, is_net = "broken: a dimension shifted", False

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        pair = SobolSampler.get_2d(self, seed, pixel, index, ti.select(dimension == 40, ti.u32(3), dimension))
        return ti.select(dimension == 40, tm.fract(pair + 0.25), pair)


@ti.data_oriented
class SlightlyUneven(IndependentSampler):
    """One dimension has the density 0.88 + 0.24 x."""

    name = "broken: not uniform"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        pair = IndependentSampler.get_2d(self, seed, pixel, index, dimension)
        x = (ti.sqrt(0.88**2 + 0.48 * pair.x) - 0.88) / 0.24
        return tm.vec2(ti.select(dimension == 17, x, pair.x), pair.y)


@ti.data_oriented
class ReachesOne(IndependentSampler):
    name = "broken: reaches 1"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        pair = IndependentSampler.get_2d(self, seed, pixel, index, dimension)
        return ti.select(pair > 0.9999, 1.0, pair)


@ti.data_oriented
class SamePixels(IndependentSampler):
    """The key of a pixel is the same for (x, y) and (y, x)."""

    name = "broken: pixels share numbers"

    @ti.func
    def pixel_number(self, x, y):
        return ti.cast(x * y + (x + y) * 1000, ti.u32)


@ti.data_oriented
class NeighboursAgree(IndependentSampler):
    """The numbers of a pixel with odd x are those of the pixel to its left, shifted by 0.1."""

    name = "broken: neighbours are alike"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        left = IndependentSampler.get_2d(self, seed, pixel >> 1, index, dimension)
        return tm.fract(left + 0.1 * ti.cast(pixel & 1, float))


@ti.data_oriented
class TaichisOwn(IndependentSampler):
    """Numbers that depend on which thread computes them."""

    name = "broken: other numbers on every run"

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        return tm.vec2(ti.random(float), ti.random(float))


@ti.data_oriented
class NoNet(IndependentSampler):
    name, is_net = "broken: promises a net", True


@ti.data_oriented
class ReplicasAgree(IndependentSampler):
    """Even and odd samples differ by so little that their difference says nothing of the error."""

    name, replicated = "broken: replicas are the same sequence", True

    @ti.func
    def get_2d(self, seed, pixel, index, dimension):
        pair = IndependentSampler.get_2d(self, seed, pixel, index >> 1, dimension)
        return tm.fract(pair + 1e-3 * ti.cast(index & 1, float))


@pytest.mark.long
@broken_parts(
    {
        RepeatsADimension: "dimension 5 and number 0 of dimension 63 depend on each other",
        ShiftsADimension: "dimension 3 and number 0 of dimension 40 depend on each other",
        SlightlyUneven: "number 0 of dimension 17 is not uniform",
        ReachesOne: "1.0 is not below 1",
        SamePixels: "two pixels or samples have the same pair",
        NeighboursAgree: "and of the one to its right",
        TaichisOwn: "differ from call to call",
        NoNet: "are no net in dimension",
        ReplicasAgree: "even and odd samples are not independent",
    }
)
def test_broken_sampler_is_found(broken, reason):
    check_fails(broken, samplers.check_sampler, reason)
