"""Every registered intersector answers as brute force."""

import numpy as np
import pytest
from support import DEBUG, start

from taichi_tracer.contracts import intersectors
from taichi_tracer.geometry import Mesh
from taichi_tracer.system.parts import PARTS

MANY = 5_000 if DEBUG else 50_000  # triangles of the hard shapes


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")
    intersectors.truth.cache_clear()  # of another precision


EVERY = pytest.mark.parametrize("part", PARTS.all("intersector"), ids=lambda part: part.name)


@EVERY
def test_intersector(part):
    intersectors.check_intersector(part)


# ── shapes that are hard to build a tree for ──


def exponentially_spaced(rng, count=73):
    """Triangles each twice as far and twice as large as the one before: the deepest tree per triangle."""
    base = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.5, 0.1]])
    return intersectors.together([(base + 1) * 2.0 ** (k - 36) for k in range(count)])


def one_centroid(rng, count=5_000):
    """Triangles of different shape whose boxes all have the same centre."""
    half = np.round(rng.uniform(0.1, 1, (count, 3)) * 1024) / 1024
    return intersectors.together([np.stack([-half, half, half * [1, -1, 1]], axis=1).reshape(-1, 3)])


def identical(rng):
    """One triangle many times: ties go to the lowest id."""
    return Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.tile(np.array([[0, 1, 2]], np.int32), (MANY, 1)))


HARD = (exponentially_spaced, one_centroid, identical)


@EVERY
@pytest.mark.parametrize("shape", HARD)
def test_the_build_of_a_hard_shape_ends(part, shape):
    intersectors.check_equals_brute_force(part, shape, count=200)
