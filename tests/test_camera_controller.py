"""Poses after keys and drags: worked out by hand for the course's camera, which looks along −z from (0, 1, 3)."""

import math

import numpy as np
import pytest

from taichi_tracer.camera_controller import (
    KEYS,
    ORBIT_ANGLE,
    SPEED,
    ZOOM_DRAG,
    Pose,
    dolly,
    is_legal,
    speed_for,
    step,
    turn,
)
from taichi_tracer.cameras.orthographic import OrthographicCamera

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


def test_half_a_second_moves_by_a_third_of_a_small_scene():
    moved = step(pose(), {"w"}, 0.5, speed=speed_for(np.zeros(3), np.full(3, 0.15)))
    np.testing.assert_allclose(moved.eye, (0, 1 + 0.375 * 0.15, 3))


@pytest.mark.parametrize(("key", "way"), [("w", (0, 0, 1)), ("s", (0, 0, -1)), ("e", (0, -1, 0)), ("q", (0, 1, 0))])
def test_where_z_is_up_the_keys_follow(key, way):
    lying = pose(eye=(0, -3, 1), at=(0, 0, 1), up=(0, 0, 1))
    np.testing.assert_allclose(step(lying, {key}, 1.0, up_axis="z").eye - lying.eye, np.multiply(1.5, way))


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


def test_right_of_the_picture_is_plus_x_when_right_handed():
    np.testing.assert_allclose(step(pose("right"), {"d"}, 0.5).eye, (0.75, 1, 3))
    np.testing.assert_allclose(step(pose("right"), {"Right"}, 0.5).at, (0.75, 1, 0))


def test_from_behind_d_still_goes_to_the_right_of_the_picture():
    behind = pose(eye=(0, 1, -3))
    moved = step(behind, {"d"}, 0.5)
    assert np.dot(moved.eye - behind.eye, behind.frame()[:3, 0]) == pytest.approx(0.75)


def test_several_keys_add_up_and_opposite_ones_cancel():
    np.testing.assert_allclose(step(pose(), {"w", "e"}, 1.0).eye, (0, 2.5, 4.5))
    np.testing.assert_allclose(step(pose(), {"a", "d", "w", "s"}, 1.0).eye, COURSE["eye"])


def test_nothing_pressed_changes_nothing():
    still = step(pose(), set(), 1.0)
    np.testing.assert_array_equal(still.eye, COURSE["eye"])
    np.testing.assert_array_equal(step(pose(), {"x", "F1"}, 1.0).eye, COURSE["eye"])


def test_i_comes_nearer_and_o_goes_back():
    np.testing.assert_allclose(step(pose(), {"i"}, 1.0).eye, (0, 1, 3 / math.e))
    np.testing.assert_allclose(step(pose(), {"o"}, 1.0).eye, (0, 1, 3 * math.e))


def test_a_zoom_drag_upwards_comes_nearer():
    np.testing.assert_allclose(step(pose(), set(), 0.0, zoom=0.5).eye, (0, 1, 3 * math.exp(-0.5 * ZOOM_DRAG)))


@pytest.mark.parametrize(("handedness", "x"), [("left", 3.0), ("right", -3.0)])
def test_a_drag_to_the_right_turns_the_camera_to_the_left_of_the_picture(handedness, x):
    # a quarter turn: the scene follows the mouse
    turned = turn(pose(handedness), (math.pi / 2) / ORBIT_ANGLE, 0.0)
    np.testing.assert_allclose(turned.eye, (x, 1, 0), atol=1e-12)
    left_of_picture = -pose(handedness).frame()[:3, 0]
    assert np.dot(turned.eye - np.array(COURSE["at"]), left_of_picture) == pytest.approx(3.0)


def test_a_drag_upwards_lowers_the_camera():
    turned = turn(pose(), 0.0, (math.pi / 6) / ORBIT_ANGLE)
    np.testing.assert_allclose(turned.eye, (0, 1 - 3 * math.sin(math.pi / 6), 3 * math.cos(math.pi / 6)))


def test_an_orbit_keeps_the_distance_and_stops_before_the_pole():
    turned = turn(pose(), 0.3, -5.0)
    assert np.linalg.norm(turned.eye - turned.at) == pytest.approx(3.0)
    assert is_legal(turned)
    assert turned.eye[1] == pytest.approx(1 + 3 * math.cos(math.radians(1.0)))


def test_moves_without_a_camera_are_ignored():
    start = pose(eye=(0.0, 1.0, 1.5))
    assert step(start, {"q"}, 1.0) is start  # eye = at
    start = pose(eye=(0.0, 4.0, 1.5))
    assert step(start, {"q"}, 1.0) is start  # straight above at: up along the gaze
    start = pose()
    assert step(start, {"o"}, 1e4) is start  # so far away that the distance overflows
    assert step(start, {"i"}, 1e4) is start  # so near that eye = at


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


def test_dolly_keeps_at():
    np.testing.assert_allclose(dolly(pose(), 2.0).eye, (0, 1, 6))
    np.testing.assert_array_equal(dolly(pose(), 2.0).at, COURSE["at"])


WINDOWED = Pose(np.array([0.0, 0, 5]), np.zeros(3), np.array([0.0, 1, 0]), window=(-2.0, 4.0, -1.0, 1.0))


@pytest.mark.parametrize(
    ("keys", "zoom", "factor"), [("e", 0, 1 / np.e), ("q", 0, np.e), ("o", 0, np.e), ("", 0.5, 1 / np.e)]
)
def test_an_orthographic_camera_zooms_its_window_about_its_middle(keys, zoom, factor):
    moved = step(WINDOWED, set(keys), 1.0, zoom=zoom)
    np.testing.assert_allclose(moved.window, [1 - 3 * factor, 1 + 3 * factor, -factor, factor])
    np.testing.assert_array_equal(moved.eye, WINDOWED.eye)


def test_the_other_keys_move_an_orthographic_camera_as_any():
    moved = step(WINDOWED, {"w", "Left"}, 1.0)
    assert moved.window == WINDOWED.window
    assert moved.eye[1] == 1.5
    camera = OrthographicCamera(4, 4, screen_window=(-1, 1, -1, 1))
    camera.set_camera_parameters(**step(Pose.of(camera), {"q"}, 1.0).parameters())
    np.testing.assert_allclose(camera.screen_window, [-np.e, np.e, -np.e, np.e])


@pytest.mark.parametrize("seconds", [200.0, -200.0])
def test_a_window_never_grows_or_shrinks_beyond_its_numbers(seconds):
    pose = WINDOWED
    for _ in range(3):
        pose = step(pose, {"q"}, seconds)
    assert pose.window[0] < pose.window[1]
    assert np.isfinite(np.float32(pose.window)).all()
