"""Random numbers of many pixels at once: the bits of the numbers of single pixels."""

import numpy as np
import pytest
import taichi as ti
from support import long_except

from taichi_tracer.fast.lanes import LANES
from taichi_tracer.fast.pixel_lanes import KeptNumbers, NumberLanes, has_points
from taichi_tracer.picture.adaptive import WHOLE, Shares
from taichi_tracer.samplers.independent import IndependentSampler
from taichi_tracer.samplers.niederreiter import NiederreiterSampler, TwoNiederreiterSampler
from taichi_tracer.samplers.sobol import SobolSampler
from taichi_tracer.system.seams import in_kernels

SAMPLERS = [SobolSampler, NiederreiterSampler, TwoNiederreiterSampler, IndependentSampler]
WIDTH, HEIGHT = 20, 12


pytestmark = pytest.mark.usefixtures("f32")


@ti.data_oriented
class Drawing:
    """Both pairs of sixteen pixels in both forms."""

    def __init__(self, sampler, shares):
        self.sampler, self.shares, self.numbers = sampler, shares, NumberLanes(sampler, shares, 2, 1)

    @in_kernels
    def kept(self, rng, lane):
        return KeptNumbers(self.numbers, rng, 0, lane)

    @ti.kernel
    def draw_together(self, index: ti.u32, out: ti.types.ndarray(ndim=2)):
        for _ in range(1):
            self.numbers.find(0, 3, 1, ti.u32(7), index)
            for lane in range(LANES):
                rng = self.kept(self.sampler.start(ti.u32(7), 0, 0, index), lane)
                rng.skip_2d()
                first, second = rng.next_2d_of_term(), rng.next_2d()
                out[lane, 0], out[lane, 1], out[lane, 2], out[lane, 3] = first.x, first.y, second.x, second.y

    @ti.kernel
    def draw_alone(self, index: ti.u32, out: ti.types.ndarray(ndim=2)):
        for lane in range(LANES):
            x, y = 4 * 3 + lane // 4, 4 * 1 + lane % 4
            i, _ = self.shares.sample_of(x, y, index)
            rng = self.sampler.start(ti.u32(7), x, y, i)
            rng.skip_2d()
            first, second = rng.next_2d_of_term(), rng.next_2d()
            out[lane, 0], out[lane, 1], out[lane, 2], out[lane, 3] = first.x, first.y, second.x, second.y


@pytest.mark.parametrize("keeps", [False, True])
@pytest.mark.parametrize("make", long_except(SAMPLERS, NiederreiterSampler))
def test_pairs_of_lanes_are_those_of_pixels(make, keeps, rng):
    sampler = make()
    sampler.width, sampler.height = WIDTH, HEIGHT
    shares = Shares(WIDTH, HEIGHT, keeps)
    if keeps:
        shares.set(rng.integers(1, WHOLE + 1, (HEIGHT, WIDTH)).astype(np.int32))
    together, alone = np.zeros((LANES, 4), np.float32), np.zeros((LANES, 4), np.float32)
    drawing = Drawing(sampler, shares)
    drawing.draw_together(13, together)
    drawing.draw_alone(13, alone)
    np.testing.assert_array_equal(together, alone)
    assert len(np.unique(together)) > 50


def test_which_samplers_have_points():
    class Own(SobolSampler):
        @ti.func
        def point(self, seed, pixel, index, dimension):
            return 0.5, 0.5

    assert all(has_points(make()) for make in SAMPLERS)
    assert not has_points(Own())
