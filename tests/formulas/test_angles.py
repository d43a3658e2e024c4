"""Angles of directions and directions of angles, against numpy in float64."""

import numpy as np
import taichi as ti
from probe import ask

from taichi_tracer.formulas import angles
from taichi_tracer.system import runtime


@ti.func
def _on_circle(rows: ti.template(), out: ti.template(), i):
    out[i, 0], out[i, 1] = angles.on_circle(rows[i, 0])


def test_points_of_the_circle_are_within_1e_7(precision, rng):
    """In f32, also at the quarters of a turn, beside them, and beyond one turn; the axes are met exactly."""
    quarters = np.arange(-8, 9) / 4
    near = np.concatenate([quarters, np.nextafter(quarters, -9), np.nextafter(quarters, 9)])
    turns = np.concatenate([rng.uniform(0, 1, 100_000), near, quarters + 1 / 8]).astype(runtime.dtype())
    found = ask(_on_circle, turns[:, None], 2).astype(float)
    angle = 2 * np.pi * turns.astype(float)
    tolerance = 1e-7 if precision == "f32" else 4e-15
    np.testing.assert_allclose(found.T, [np.cos(angle), np.sin(angle)], atol=tolerance)
    np.testing.assert_allclose((found**2).sum(axis=1), 1, atol=2 * tolerance)
    if precision == "f32":
        on_axes = ask(_on_circle, quarters[:, None], 2)
        np.testing.assert_array_equal(on_axes.T, np.round([np.cos(2 * np.pi * quarters), np.sin(2 * np.pi * quarters)]))


@ti.func
def _angles(rows: ti.template(), out: ti.template(), i):
    out[i, 0], out[i, 1] = angles.azimuth(rows[i, 0], rows[i, 1]), angles.latitude(rows[i, 2])


def test_both_angles_are_within_3e_7(precision, rng):
    """In f32, of all quadrants, axes and signed zeros, and to the poles; in f64 they are atan2 and asin."""
    rows = rng.normal(size=(100_000, 3)) * 10.0 ** rng.uniform(-10, 10, (100_000, 1))
    rows[:, 2] = np.concatenate([rng.uniform(-1, 1, 50_000), np.sin(np.pi / 2 - 10.0 ** rng.uniform(-4, 0, 50_000))])
    rows = rows.astype(runtime.dtype())
    tolerance = 3e-7 if precision == "f32" else 1e-15
    y, x, height = rows.T.astype(float)
    np.testing.assert_allclose(ask(_angles, rows, 2).T, [np.arctan2(y, x), np.arcsin(height)], atol=tolerance)
    ends = [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, -1.0, -1.0], [-1.0, 0.0, 1.0000001], [0.0, 0.0, -0.5]]
    half = np.pi / 2
    expected = [[0, half, np.pi, -half, 0], [0, half, -half, half, -np.pi / 6]]
    np.testing.assert_allclose(ask(_angles, ends, 2).T, expected, atol=tolerance)
