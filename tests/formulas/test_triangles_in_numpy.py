"""Normals and thinness of many triangles: numpy and kernels give the same bits."""

import numpy as np
import taichi as ti
from probe import vec3

from taichi_tracer.formulas import triangles
from taichi_tracer.formulas.triangles import thinness_of, unit_normals
from taichi_tracer.system import runtime


@ti.kernel
def _by_kernel(rows: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(rows.shape[0]):
        v0, v1, v2 = vec3(rows, i, 0), vec3(rows, i, 3), vec3(rows, i, 6)
        n = triangles.unit(triangles.stable_normal(v0, v1, v2))
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = n.x, n.y, n.z, triangles.thinness(v0, v1, v2)


def test_both_ways_give_the_same_bits(precision, rng):
    corners = rng.normal(size=(20_000, 3, 3))
    corners[:5_000] *= 10.0 ** rng.integers(-25, 25, (5_000, 1, 1))
    corners[5_000:8_000, 2] = corners[5_000:8_000, 1] + 1e-6 * rng.normal(size=(3_000, 3))  # slivers
    corners[8_000:9_000, 1] = corners[8_000:9_000, 0]  # no area
    corners[9_000:12_000] = np.round(corners[9_000:12_000])  # edges of equal length, right angles
    rows = corners.reshape(-1, 9).astype(runtime.dtype())
    wanted = np.empty((len(rows), 4), rows.dtype)
    _by_kernel(rows, wanted)
    own = rows.reshape(-1, 3, 3).swapaxes(0, 1)
    np.testing.assert_array_equal(unit_normals(*own), wanted[:, :3])
    np.testing.assert_array_equal(thinness_of(*own), wanted[:, 3])
    assert np.isnan(thinness_of(*own)[8_000:9_000]).all()
