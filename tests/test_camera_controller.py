"""Poses after keys and drags: worked out by hand for the course's camera, which looks along −z from (0, 1, 3)."""

import math

import numpy as np
import pytest

from taichi_tracer.camera_controller import (
    KEYS,
    SPEED,
    Pose,
    is_legal,
    speed_for,
    step,
    turn,
)

COURSE = {"eye": (0.0, 1.0, 3.0), "at": (0.0, 1.0, 0.0), "up": (0.0, 1.0, 0.0)}


def pose(handedness="left", **changes):
    return Pose(**{name: np.array(v, float) for name, v in (COURSE | changes).items()}, handedness=handedness)


@pytest.mark.parametrize(
    ("size", "speed"),
    [(2.0, 1.5), (0.5, 1.5), (5.0, 1.5), (0.15, 0.1125), (300.0, 225.0), (1e-6, 7.5e-7), (0.0, 1.5), (np.inf, 1.5)],
)
def test_the_speed_is_that_of_the_course_or_in_proportion_to_the_scene(size, speed):
    low = np.array([1.0, -2.0, 0.0])
    assert speed_for(low, low + [size / 3, size, 0]) == pytest.approx(speed)
    assert SPEED == 1.5


@pytest.mark.parametrize(
    ("key", "eye", "at"),
    [
        ("w", (0, 1.75, 3), (0, 1, 0)),
        ("s", (0, 0.25, 3), (0, 1, 0)),
        ("e", (0, 1, 3.75), (0, 1, 0)),
        ("q", (0, 1, 2.25), (0, 1, 0)),
        # x_c = up × z_c = (−1, 0, 0): the right of the picture is −x (C-5)
        ("d", (-0.75, 1, 3), (0, 1, 0)),
        ("a", (0.75, 1, 3), (0, 1, 0)),
        ("Right", (0, 1, 3), (-0.75, 1, 0)),
        ("Left", (0, 1, 3), (0.75, 1, 0)),
        ("Up", (0, 1, 3), (0, 1.75, 0)),
        ("Down", (0, 1, 3), (0, 0.25, 0)),
    ],
)
def test_a_key_moves_one_point_along_one_axis(key, eye, at):
    moved = step(pose(), {key}, seconds=0.5)
    np.testing.assert_allclose(moved.eye, eye, atol=1e-15)
    np.testing.assert_allclose(moved.at, at, atol=1e-15)
    np.testing.assert_array_equal(moved.up, COURSE["up"])


def test_an_orbit_keeps_the_distance_and_stops_before_the_pole():
    turned = turn(pose(), 0.3, -5.0)
    assert np.linalg.norm(turned.eye - turned.at) == pytest.approx(3.0)
    assert is_legal(turned)
    assert turned.eye[1] == pytest.approx(1 + 3 * math.cos(math.radians(1.0)))


def test_random_walks_always_leave_a_camera():
    rng = np.random.default_rng(7)
    at_pole = 0
    for _ in range(20):
        walker = pose()
        for _ in range(100):
            keys = set(rng.choice(KEYS, size=rng.integers(0, 4)))
            walker = step(walker, keys, rng.uniform(0, 0.5), tuple(rng.normal(0, 0.3, 2)), rng.normal(0, 0.1))
            assert is_legal(walker)
            at_pole += abs(walker.frame()[1, 2]) > 0.99
    assert at_pole > 0  # the walks did go where it is hard


WINDOWED = Pose(np.array([0.0, 0, 5]), np.zeros(3), np.array([0.0, 1, 0]), window=(-2.0, 4.0, -1.0, 1.0))


@pytest.mark.parametrize(
    ("keys", "zoom", "factor"), [("e", 0, 1 / np.e), ("q", 0, np.e), ("o", 0, np.e), ("", 0.5, 1 / np.e)]
)
def test_an_orthographic_camera_zooms_its_window_about_its_middle(keys, zoom, factor):
    moved = step(WINDOWED, set(keys), 1.0, zoom=zoom)
    np.testing.assert_allclose(moved.window, [1 - 3 * factor, 1 + 3 * factor, -factor, factor])
    np.testing.assert_array_equal(moved.eye, WINDOWED.eye)
