"""Points on lamps: solid angles against numpy, and directions that are uniform in them."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.area_lights import solid_angle, uniform_spherical_triangle, uniform_triangle
from taichi_tracer.system import runtime

TRIANGLES = {
    "small": [[1, 0, 5], [0, 1, 5], [0, 0, 5]],
    "an octant": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "almost a hemisphere": [[9, 0, 0.1], [-5, 8, 0.1], [-5, -8, 0.1]],
    "a sliver": [[1, 0, 0.2], [0, 0.01, 1], [-1, 0, 0.2]],
    "other way round": [[0, 1, 2], [1, 0, 2], [-1, -1, 1]],
}


@ti.kernel
def run(vertices: ti.types.ndarray(ndim=2), xi: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(xi.shape[0]):
        a = tm.vec3(vertices[0, 0], vertices[0, 1], vertices[0, 2])
        b = tm.vec3(vertices[1, 0], vertices[1, 1], vertices[1, 2])
        c = tm.vec3(vertices[2, 0], vertices[2, 1], vertices[2, 2])
        omega = solid_angle(a, b, c)
        w = uniform_spherical_triangle(
            tm.normalize(a), tm.normalize(b), tm.normalize(c), omega, tm.vec2(xi[i, 0], xi[i, 1])
        )
        out[i, 0] = omega
        for k in ti.static(range(3)):
            out[i, 1 + k] = w[k]


def by_excess(vertices):
    """The solid angle as α + β + γ − π (Girard), in float64."""
    a, b, c = (v / np.linalg.norm(v) for v in np.asarray(vertices, float))

    def angle(at, one, other):
        n, m = np.cross(at, one), np.cross(at, other)
        return np.arctan2(np.linalg.norm(np.cross(n, m)), n @ m)

    return angle(a, b, c) + angle(b, c, a) + angle(c, a, b) - np.pi


@pytest.mark.parametrize("name", TRIANGLES)
def test_solid_angle_and_uniform_directions(precision, name):
    """Ω by Girard; all directions lie in the triangle; Ω · mean(cos θ) is the irradiance of Lambert's formula."""
    dtype, vertices = runtime.dtype(), np.array(TRIANGLES[name], float)
    n = 1 << 14
    i = np.arange(n)
    xi = np.stack([(i + 0.5) / n, (i * 0.6180339887498949) % 1], axis=1).astype(dtype)
    out = np.zeros((n, 4), dtype)
    run(vertices.astype(dtype), xi, out)
    omega, w = float(out[0, 0]), out[:, 1:].astype(np.float64)
    assert omega == pytest.approx(by_excess(vertices), rel=1e-5 if dtype == np.float32 else 1e-10)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=1e-5)
    inside = np.linalg.solve(vertices.T, w.T).min(axis=0)
    assert inside.min() > (-1e-2 if dtype == np.float32 else -1e-9)  # in units of the sides; slivers are thin
    for normal in np.eye(3):
        expected = signed_irradiance(vertices, normal)
        assert omega * (w @ normal).mean() == pytest.approx(expected, abs=2e-3 * omega)


def signed_irradiance(vertices, normal):
    """∫ n·ω dω over the triangle, without a horizon: Lambert's formula for radiance 1 ."""
    v = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    total = 0.0
    for p, q in zip(v, np.roll(v, -1, axis=0), strict=True):
        cross = np.cross(p, q)
        total += np.arctan2(np.linalg.norm(cross), p @ q) * (normal @ cross) / np.linalg.norm(cross) / 2
    return total * np.sign(np.cross(v[0], v[1]) @ v[2])


@ti.kernel
def run_triangle(xi: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(xi.shape[0]):
        place = uniform_triangle(tm.vec2(xi[i, 0], xi[i, 1]))
        out[i, 0], out[i, 1] = place.x, place.y


def test_points_are_uniform_on_a_triangle(precision):
    """The moments of the uniform density: E[u] = 1/3, E[u²] = 1/6, E[uv] = 1/12."""
    dtype, n = runtime.dtype(), 1 << 14
    i = np.arange(n)
    xi = np.stack([(i + 0.5) / n, (i * 0.6180339887498949) % 1], axis=1).astype(dtype)
    out = np.zeros((n, 2), dtype)
    run_triangle(xi, out)
    u, v = out.astype(np.float64).T
    assert u.min() >= 0
    assert v.min() >= 0
    assert (u + v).max() <= 1 + 1e-6
    found = [u.mean(), v.mean(), (u * u).mean(), (v * v).mean(), (u * v).mean()]
    np.testing.assert_allclose(found, [1 / 3, 1 / 3, 1 / 6, 1 / 6, 1 / 12], atol=1e-3)
