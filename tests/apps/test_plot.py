"""The drawing of errors in the window: every estimator in its colour, and numbers that do not touch each other."""

import numpy as np

from taichi_tracer.apps import plot


def falling(scale, count, power=-0.5):
    return [(0.1 * k, scale * (0.1 * k) ** power) for k in range(1, count)]


def pixels_of(picture, colour):
    return int((abs(picture - np.array(plot.as_bytes(colour)) / 255).max(axis=2) < 0.01).sum())


def test_curves_of_all_estimators_are_drawn():
    curves = {"mis": falling(0.02, 40), "brdf": falling(0.2, 30), "uniform": [(0.1, 0.5)]}
    both = plot.draw_curves(curves, "mis", 248, 170)
    alone = plot.draw_curves({"mis": curves["mis"]}, "mis", 248, 170)
    assert both.shape == (170, 248, 3)
    assert pixels_of(both, plot.COLOURS[0]) > 100
    assert pixels_of(both, plot.COLOURS[1]) > 50
    assert pixels_of(alone, plot.COLOURS[1]) == 0
    assert pixels_of(both, plot.COLOURS[2]) == 0  # one point is no curve


def test_errors_that_are_not_known_are_left_out():
    empty = plot.draw_curves({}, "mis", 248, 170)
    nothing = plot.draw_curves({"mis": [(0.1, float("nan")), (0.2, 0.0)]}, "mis", 248, 170)
    np.testing.assert_array_equal(empty, nothing)


def test_ticks_are_one_two_and_five_and_powers_of_ten_come_first():
    assert plot.ticks(0.8, 12) == [1, 10, 2, 5]
    assert plot.ticks(2.5, 4) == []
