"""The hard cases of light and of surfaces: they pass, and each finds the mistake that it is about."""

import numpy as np
import pytest
from oracles import lamps as independent

from taichi_tracer.studies.hard import light_cases, oracle
from taichi_tracer.studies.hard.case import CaseTally

pytestmark = pytest.mark.usefixtures("f32")


def test_lamberts_formula_agrees_with_an_independent_one(rng):
    """For the parts of quads above the horizon, from both sides."""
    fronts = 0
    for _ in range(200):
        a, b, c = rng.normal(size=(3, 3))
        point, normal = rng.normal(size=3), np.array([0.0, 0, 1])
        corners = independent.clipped(point, normal, np.array([a, b, b + c - a, c]))
        if len(corners) < 3:
            continue
        found = oracle.polygon_irradiance(point, normal, corners)
        is_front = np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ (corners[0] - point) < 0
        expected = independent.polygon_irradiance(point, normal, corners) if is_front else 0.0
        assert found == pytest.approx(expected, abs=1e-12)
        fronts += found > 0
    assert fronts > 20


def test_a_lamp_that_fills_the_sky_gives_pi():
    far = 1e6
    corners = np.array([[-far, 1, -far], [far, 1, -far], [far, 1, far], [-far, 1, far]])
    assert oracle.polygon_irradiance((0, 0, 0), np.array([0.0, 1, 0]), corners) == pytest.approx(np.pi, abs=1e-5)


# ── mistakes ──


EPSILON = 2.0**-23

pytestmark = pytest.mark.usefixtures("f32")


CASES = [pytest.param(light_cases.microfacets, marks=pytest.mark.slow), light_cases.rough_layers]


@pytest.mark.parametrize("case", CASES)
def test_it_passes(case):
    found = CaseTally()
    case(found, EPSILON)
    assert found.tried > 100
    assert (found.wrong, found.nan) == (0, 0)
