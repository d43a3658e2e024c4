"""Frames about a direction: right-handed and orthonormal, wherever it points."""

import numpy as np
import taichi as ti
from oracles import light
from probe import ask, put, vec3

from taichi_tracer.formulas import frames
from taichi_tracer.system import runtime


def directions(rng):
    """Random ones, and those where a frame is hard to find."""
    n = rng.normal(size=(20_000, 3))
    n[:6] = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [1e-8, 0, -1], [0, 1e-4, -1]]
    return light.to_unit(n).astype(runtime.dtype())


@ti.func
def _frame(rows: ti.template(), out: ti.template(), i):
    x, y = frames.frame_about(vec3(rows, i, 0))
    put(out, i, 0, x)
    put(out, i, 3, y)


def test_frames_are_right_handed_and_orthonormal(precision, rng):
    n = directions(rng)
    out = ask(_frame, n, 6).astype(np.float64)
    x, y = out[:, :3], out[:, 3:]
    tolerance = 4e-7 if precision == "f32" else 1e-15
    np.testing.assert_allclose(np.cross(x, y), n, atol=tolerance)
    np.testing.assert_allclose((x * y).sum(1), 0, atol=tolerance)
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1, atol=tolerance)


@ti.func
def _from_frame(rows: ti.template(), out: ti.template(), i):
    put(out, i, 0, frames.from_frame(vec3(rows, i, 0), rows[i, 3], rows[i, 4], rows[i, 5]))


def test_a_direction_in_a_frame_has_its_angle_and_unit_length(precision, rng):
    n, theta, turn = directions(rng), rng.uniform(0, np.pi, 20_000), rng.uniform(0, 1, 20_000)
    rows = np.column_stack([n, np.cos(theta), np.sin(theta), turn])
    w = ask(_from_frame, rows, 3).astype(np.float64)
    tolerance = 1e-6 if precision == "f32" else 4e-15
    np.testing.assert_allclose((w * n).sum(axis=1), np.cos(theta), atol=tolerance)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=tolerance)


@ti.func
def _mirrored(rows: ti.template(), out: ti.template(), i):
    put(out, i, 0, frames.mirrored(vec3(rows, i, 0), vec3(rows, i, 3)))


def test_the_mirrored_direction_leaves_under_the_same_angle(precision, rng):
    """ω_r·n = ω_o·n, the three lie in a plane, and mirroring twice gives ω_o back."""
    n, w_o = directions(rng).astype(np.float64), light.sphere(rng, 20_000)
    w_r = ask(_mirrored, np.column_stack([w_o, n]), 3).astype(np.float64)
    tolerance = 1e-6 if precision == "f32" else 4e-15
    np.testing.assert_allclose((w_r * n).sum(axis=1), (w_o * n).sum(axis=1), atol=tolerance)
    np.testing.assert_allclose((np.cross(w_o, n) * w_r).sum(axis=1), 0, atol=tolerance)
    np.testing.assert_allclose(ask(_mirrored, np.column_stack([w_r, n]), 3), w_o, atol=tolerance)
