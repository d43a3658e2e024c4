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
