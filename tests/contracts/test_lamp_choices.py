"""Every registered choice of lamps, and the handout's, keeps its contract; those that break it are found."""

import numpy as np
import pytest
import taichi as ti

import taichi_tracer as tt
from contracts.registered import broken_parts, check_fails, every
from taichi_tracer.contracts import lamp_choices
from taichi_tracer.lights.choose_by_weight import ByPower

pytestmark = pytest.mark.usefixtures("f32")


@every("lamp choice", alike=("area",))
def test_lamp_choice(part):
    lamp_choices.check_lamp_choice(part)


def test_the_handouts_sampler_of_mesh_lights():
    lamp_choices.check_lamp_choice(tt.MeshLightSampler)


# ── mistakes ──


@ti.data_oriented
class OtherProbability(ByPower):
    name = "broken: choose and probability disagree"

    @ti.func
    def choose(self, x, n, xi):
        lamp, probability, rest = ByPower.choose(self, x, n, xi)
        return lamp, ti.sqrt(probability), rest


@ti.data_oriented
class HalfOfAll(ByPower):
    name = "broken: the sum is 1/2"

    @ti.func
    def probability(self, x, n, lamp):
        return 0.5 * ByPower.probability(self, x, n, lamp)


@ti.data_oriented
class OtherLamps(ByPower):
    """The random number is squared, so that the first lamps are chosen too often."""

    name = "broken: lamps are not chosen with their probabilities"

    @ti.func
    def choose(self, x, n, xi):
        return ByPower.choose(self, x, n, xi * xi)


@ti.data_oriented
class WholeNumber(ByPower):
    """The first lamps get the first places."""

    name = "broken: the rest is the random number"

    @ti.func
    def choose(self, x, n, xi):
        lamp, probability, rest = ByPower.choose(self, x, n, xi)
        return lamp, probability, xi


@ti.data_oriented
class OneTooFar(ByPower):
    name = "broken: lamps counted from 1"

    @ti.func
    def choose(self, x, n, xi):
        lamp, probability, rest = ByPower.choose(self, x, n, xi)
        return lamp + 1, probability, rest


@ti.data_oriented
class InfiniteNearby(ByPower):
    """The formula has the distance to the origin in it, which is 0 for one of the points."""

    name = "broken: 0/0 at a point"

    @ti.func
    def probability(self, x, n, lamp):
        return ByPower.probability(self, x, n, lamp) * x.norm() / x.norm()


@ti.data_oriented
class ForgetsDimLamps(ByPower):
    """A cumulative distribution of plain f32."""

    name = "broken: dim lamps are never chosen"

    def prepare(self, lamps):
        super().prepare(lamps)
        weights = self.weights(lamps)
        self.cdf.from_numpy(np.concatenate([[0], np.cumsum(weights) / weights.sum()]).astype(np.float32))


@pytest.mark.long
@broken_parts(
    {
        OtherProbability: "choose returns a probability that is wrong",
        HalfOfAll: "add up to 0.5",
        OtherLamps: "not chosen with their probabilities",
        WholeNumber: "rest is not uniform",
        OneTooFar: "chooses lamp 37 of 37",
        InfiniteNearby: "probability is not finite",
        ForgetsDimLamps: "the probability of a dim lamp is 0",
    }
)
def test_broken_choice_is_found(broken, reason):
    check_fails(broken, lamp_choices.check_lamp_choice, reason)
