"""What every choice of lamps must do: lamps as often as their probabilities, which add up to 1, and no lamp lost.

The choice is asked as ``Lamps`` asks it: for a point x with the normal n, and with random numbers in [0, 1) that are
multiples of 2⁻²⁴, as those of f32 are.
"""

import numpy as np

import taichi_tracer as tt
from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.contracts.statistics import (
    LAST,
    check_near,
    check_range,
    chi_square_p,
    chi_square_sf,
    sidak,
    uniform_pairs,
)
from taichi_tracer.geometry import Mesh

SAMPLES = 200_000  # of each point
BINS = 16  # of what is left of a random number
ROUNDING = 1e-5  # of a probability: a product of shares in f32
LAMPS = 37  # not a power of 2, so that a binary tree has empty leaves
DIM_LAMP, DIM_SIZE = 18, 1e-6  # one in the middle of the list, with about 10⁻¹² of the area and of the power of all


def many_lamps():
    """Triangles whose fronts emit, in a cube of side 6, of very different sizes and powers.

    ``DIM_LAMP`` hangs high above them all, and faces down.
    """
    rng = np.random.default_rng(4)
    size = 10.0 ** rng.uniform(-2, 0, (LAMPS, 1, 1))
    corners = rng.uniform(-3, 3, (LAMPS, 1, 3)) + size * rng.normal(size=(LAMPS, 3, 3))
    corners[DIM_LAMP] = DIM_SIZE * np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]]) + [0, 10, 0]
    radiance = 10.0 ** rng.uniform(-2, 2, LAMPS)
    radiance[DIM_LAMP] = 1
    faces, ids = np.arange(3 * LAMPS, dtype=np.int32).reshape(-1, 3), np.arange(LAMPS, dtype=np.int32)
    materials = [tt.Material(f"lamp{i}", Ke=(ke, ke, ke)) for i, ke in enumerate(radiance)]
    return Mesh(corners.reshape(-1, 3), faces, face_materials=ids, materials=materials)


def points(first):
    """(x, n) of points among the lamps, on the first lamp, at its corner, in its plane, far away, and farther."""
    edge, other = first[1] - first[0], first[2] - first[0]
    normal = np.cross(edge, other) / np.linalg.norm(np.cross(edge, other))
    centre, up = first.mean(axis=0), np.array([0.0, 1.0, 0.0])
    return [
        (np.zeros(3), up),
        (np.zeros(3), -up),
        (centre, normal),
        (centre + 1e-4 * normal, -normal),
        (first[0], up),
        (centre + 5 * edge, normal),
        (np.array([40.0, -30.0, 20.0]), up),
        (np.array([1e8, 1e8, -1e8]), up),
    ]


# ── the checks ──


def check_lamp_choice(part):
    """Probabilities that add up to 1, choices that follow them, and no lamp that is never chosen."""
    scene = tt.SceneData(many_lamps(), lamp_choice=part)
    scene.lamps.prepare()
    choice, places = scene.lamps.choice, points(scene.mesh.vertices[:3])
    choose = Rows(choice.choose, [3, 3, 1], [WHOLE, 1, 1])  # x, n, (N,) ξ → lamp, probability, rest, (N,)
    probability = Rows(choice.probability, [3, 3, WHOLE], [1])
    level = sidak(2 * len(places))
    for i, (x, n) in enumerate(places):
        expected = probability(x, n, np.arange(LAMPS))
        xi = uniform_pairs(SAMPLES, seed=i)[:, 0]
        xi[:2] = 0, LAST
        lamp, found, rest = choose(x, n, xi)
        check_choices(f"{part.name} at {x}", expected, lamp.astype(int), found, level)
        if not choice.samples_points:  # such a choice draws the point itself, and nobody uses what is left
            check_rest(f"{part.name} at {x}", lamp.astype(int), rest, level)
    # The dim lamp lights a point from which all others are below the horizon: if it is lost, the point is black.
    dim = probability([0.0, 9.9, 0.0], [0.0, 1.0, 0.0], DIM_LAMP)[0]
    assert dim > 0, f"{part.name}: the probability of a dim lamp is 0"
    scene.destroy()


def check_choices(what, expected, lamp, probability, level):
    """There is such a lamp, and it is chosen with its probability."""
    check_range(f"{what}: a probability", expected, 0)
    check_near(f"{what}: the probabilities of all lamps do not add up to 1", expected.sum(), 1, LAMPS * ROUNDING)
    check_range(f"{what}: the number of a lamp that choose returns", lamp, 0, LAMPS - 1)
    shares = probability / expected[lamp]
    check_near(f"{what}: choose returns a probability that is not that of its lamp", shares, 1, LAMPS * ROUNDING)
    p = chi_square_p(np.bincount(lamp, minlength=LAMPS), SAMPLES * expected)
    assert p > level, f"{what}: lamps are not chosen with their probabilities: p = {p:.1e}"


def check_rest(what, lamp, rest, level):
    """What is left of the random number is uniform in [0, 1), for each lamp that is chosen often enough: by χ²."""
    check_range(f"{what}: the rest", rest, 0, LAST)
    counts = np.zeros((lamp.max() + 1, BINS))
    np.add.at(counts, (lamp, (rest * BINS).astype(int)), 1)
    counts = counts[counts.sum(axis=1) >= 10 * BINS]
    expected = counts.sum(axis=1, keepdims=True) / BINS
    p = chi_square_sf((np.square(counts - expected) / expected).sum(), len(counts) * (BINS - 1))
    assert p > level, f"{what}: the rest is not uniform among the samples of a lamp: p = {p:.1e}"
