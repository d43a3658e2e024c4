"""What every light must do: samples that follow its density, radiance that is that of the ray, right distances.

Directions leave the point that is lit. Densities are per solid angle. A light that is not infinitely far away is met by
rays: the checks are given the intersector of a scene that contains it.
"""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.contracts.lab import Rows
from taichi_tracer.contracts.statistics import (
    ABOVE_ZERO,
    CORNERS,
    check_density,
    check_near,
    check_range,
    check_unit,
    directions_everywhere,
    sidak,
    uniform_pairs,
)
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.ray import no_hit

SAMPLES = 100_000
POINTS = np.array([[0.0, 0.0, 0.0], [0.7, -0.3, 0.4], [-30.0, 20.0, 10.0]])  # that are lit
VALUE_TOLERANCE = 1e-4  # between what ``sample`` returns and what is asked for its direction
FEW = 5e-3  # of the samples, which rounding moves over an edge, such as that of a texel


class Bench:
    """A light in a scene, to be asked from Python.

    Args:
        intersector: of a scene that contains the light; None where rays meet nothing.
        points: (N, 3) that are lit.
        cells: ``SphereCells`` at whose edges the density may jump; chosen by the samples when None.
    """

    def __init__(self, light, intersector=None, points=POINTS, cells=None):
        self.points, self.light, self.cells, is_near = points, light, cells, intersector is not None
        light.prepare()

        @ti.func
        def values(x, w_i):
            ray = tt.Ray(origin=x, direction=w_i)
            hit = no_hit()
            if ti.static(is_near):
                hit = intersector.query_segment(ray, 0.0, tm.inf)
            return light.pdf(x, w_i, hit), light.radiance(ray, hit)

        self.sample = Rows(light.sample, [3, 2], [3, 1, 3, 1])  # x, (N, 2) ξ → w_i, distance, radiance, pdf
        self.values = Rows(values, [3, 3], [1, 3])  # x, (N, 3) w_i → pdf, radiance


# ── the checks ──


def check_ambient(bench):
    """Finite, not negative, in proportion to Ka, and the same every time: it has no other argument."""
    light = bench.light

    @ti.func
    def reflected(ka):
        return light.reflected(ti.Struct(Ka=tm.vec3(ka)))

    shown, ka = Rows(reflected, [1], [3])([1.0, 0.0, 2.0]), np.array([[1.0], [0.0], [2.0]])
    check_range(f"{light.name}: reflected", shown, 0)
    check_near(f"{light.name}: it is not in proportion to Ka", shown, ka * shown[0], VALUE_TOLERANCE * shown.max())


def steps(light):
    """The checks of the ``Bench`` of a light, in the order in which a mistake is looked for.

    A scene for a light that rays meet is not known here: of it, only samples are checked.
    """
    if light.is_ambient:
        return (check_ambient,)
    if light.is_delta:
        return check_samples_are_legal, check_delta
    if not light.is_far:
        return (check_samples_are_legal,)
    return check_samples_are_legal, check_sample_agrees_with_values, check_sample_follows_pdf


def check_samples_are_legal(bench):
    """Directions of unit length; finite radiance and densities, of at least 0; distances above 0, ∞ where it is far."""
    light, xi = bench.light, np.concatenate([CORNERS, uniform_pairs(5000, seed=1)])
    for x in bench.points:
        w_i, distance, radiance, pdf = bench.sample(x, xi)
        what = f"{light.name} at {x}"
        check_unit(what, w_i)
        check_range(f"{what}: a radiance that sample returns", radiance, 0)
        check_range(f"{what}: a pdf that sample returns", pdf, ABOVE_ZERO)
        assert (distance > 0).all(), f"{what}: the light is at the distance {distance.min()}"
        assert (np.isinf(distance) == light.is_far).all(), f"{what}: distance is {distance[0]}, is_far {light.is_far}"
        density, seen = bench.values(x, directions_everywhere(2000))
        check_range(f"{what}: pdf", density, 0)
        check_range(f"{what}: radiance", seen, 0)


def check_delta(bench):
    """A pdf of 1; no ray sees it; from everywhere its samples lie in one place, or if it is far, in one direction."""
    light, xi = bench.light, uniform_pairs(50, seed=2)
    ends = []
    for x in bench.points:
        w_i, distance, _, pdf = bench.sample(x, xi)
        assert (pdf == 1).all(), f"{light.name}: sample of a delta light returns a pdf of {pdf[pdf != 1][0]}, not 1"
        density, seen = bench.values(x, np.concatenate([w_i, directions_everywhere(200)]))
        assert not density.any(), f"{light.name}: pdf of a delta light is 0"
        assert not seen.any(), f"{light.name}: no ray sees a delta light: radiance is 0"
        ends.append(w_i if light.is_far else x + distance[:, None] * w_i)
    what = "directions differ" if light.is_far else "distances are wrong: seen from several points, its places differ"
    check_near(f"{light.name}: the {what}", ends, ends[0][0], VALUE_TOLERANCE * (1 + np.abs(ends).max()))


def check_sample_agrees_with_values(bench):
    """``sample`` returns the density and the radiance that ``pdf`` and ``radiance`` have for its direction."""
    for x in bench.points:
        w_i, _, radiance, pdf = bench.sample(x, uniform_pairs(5000, seed=3))
        density, seen = bench.values(x, w_i)
        for name, a, b in (("pdf", pdf, density), ("radiance", radiance, seen)):
            off = np.abs(a - b) > VALUE_TOLERANCE * (np.abs(a) + np.abs(b))
            assert off.mean() < FEW, (
                f"{bench.light.name}: sample returns the {name} {a[off][0]}, but that of its direction is {b[off][0]}"
            )


def check_sample_follows_pdf(bench):
    """The samples are those of pdf, and ∫ pdf = 1: χ² at the level that ``sidak`` gives for all points."""
    for i, x in enumerate(bench.points):
        what = f"{bench.light.name} at {x}"
        check_density(
            what,
            lambda xi, x=x: bench.sample(x, xi)[0],
            lambda w_i, x=x: bench.values(x, w_i)[0],
            SAMPLES,
            sidak(len(bench.points)),
            seed=10 + i,
            cells=bench.cells,
        )


def check_facts(bench):
    """What checkpoints know of it is the same in every run: no address in memory."""
    facts = bench.light.facts()
    assert " at 0x" not in repr(facts), f"{bench.light.name}: facts differ from run to run: {facts}"
