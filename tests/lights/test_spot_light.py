"""A point that shines into a cone: its edges, and cones without an inside or without an outside."""

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.contracts.lights import Bench

pytestmark = pytest.mark.usefixtures("f32")


def shares(degrees, **options):
    """s(θ): the radiance at points 2 away from a spot of intensity 4 that shines down from (1, 2, 3)."""
    bench = Bench(tt.SpotLight((1, 2, 3), (1, -9, 3), 4.0, **options))
    theta = np.radians(degrees)
    points = np.array([1, 2, 3]) + 2 * np.stack([np.sin(theta), -np.cos(theta), 0 * theta], axis=-1)
    return np.array([bench.sample(x, np.array([[0.5, 0.5]]))[2][0, 0] for x in points])


def test_it_falls_linearly_between_the_two_angles():
    degrees = np.array([0, 10, 19.99, 22.5, 25, 27.5, 29.99, 30.01, 90, 180])
    expected = np.clip((30 - degrees) / 10, 0, 1)
    np.testing.assert_allclose(shares(degrees, cutoff=30, falloff=20), expected, atol=1e-3)


@pytest.mark.parametrize(("angle", "lit"), [(0.0, [0, 0, 0]), (45.0, [1, 0, 0]), (180.0, [1, 1, 1])])
def test_an_edge_without_width(angle, lit):
    np.testing.assert_allclose(shares(np.array([1e-2, 60, 179.9]), cutoff=angle, falloff=angle), lit, rtol=1e-5)


def test_a_narrow_cone_keeps_its_edges():
    """0.01° wide: the cosine of such an angle differs from 1 by a quarter of the ε of f32."""
    degrees = np.array([0.002, 0.0075, 0.02])
    np.testing.assert_allclose(shares(degrees, cutoff=0.01, falloff=0.005), [1, 0.5, 0], atol=0.01)


def test_wrong_numbers_are_told():
    for options in ({"cutoff": 10, "falloff": 20}, {"cutoff": 181}, {"falloff": -1}, {"cutoff": float("nan")}):
        with pytest.raises(tt.InputError, match="spot light: 0 <= falloff <= cutoff <= 180 degrees"):
            tt.SpotLight(**options)
    with pytest.raises(tt.InputError, match="the way to its target must have a length"):
        tt.SpotLight((1, 1, 1), (1, 1, 1))
