"""The sphere test for sixteen rays at once: the bits of the plain one, and no sphere is left out."""

import numpy as np
import pytest
import taichi as ti
from probe import vec3

from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.packet_shapes import SphereLanes
from taichi_tracer.formulas.spheres import sphere_roots, widened
from taichi_tracer.system import runtime


@ti.kernel
def _both(
    store: ti.template(),
    rays: ti.types.ndarray(ndim=3),
    spheres: ti.types.ndarray(ndim=2),
    plain: ti.types.ndarray(ndim=3),
    packed: ti.types.ndarray(ndim=3),
):
    for i in range(rays.shape[0]):
        c = 0
        ox, oy, oz, dx, dy, dz = lanes(0.0), lanes(0.0), lanes(0.0), lanes(0.0), lanes(0.0), lanes(0.0)
        for lane in ti.static(range(LANES)):
            ox[lane], oy[lane], oz[lane] = rays[i, lane, 0], rays[i, lane, 1], rays[i, lane, 2]
            dx[lane], dy[lane], dz[lane] = rays[i, lane, 3], rays[i, lane, 4], rays[i, lane, 5]
        centre, radius = vec3(spheres, i, 0), spheres[i, 3]
        store.take(c, dx, dy, dz)
        may_meet = store.may_meet(c, ox, oy, oz, centre, radius, lanes(-1.0))
        is_met, entry, exit = store.solve(c, radius)
        for lane in ti.static(range(LANES)):
            packed[i, lane, 0], packed[i, lane, 1] = ti.cast(may_meet[lane], float), ti.cast(is_met[lane], float)
            packed[i, lane, 2], packed[i, lane, 3] = entry[lane], exit[lane]
            o = widened(ti.math.vec3(ox[lane], oy[lane], oz[lane]))
            d = widened(ti.math.vec3(dx[lane], dy[lane], dz[lane]))
            met, t_in, t_out = sphere_roots(o, d, widened(centre), widened(radius))
            plain[i, lane, 1] = ti.cast(met, float)
            plain[i, lane, 2], plain[i, lane, 3] = ti.cast(t_in, float), ti.cast(t_out, float)


def rays_and_spheres(rng, count=300):
    """Rays towards spheres, past them and along their tangents, from outside, inside and from their surface."""
    centre = rng.normal(size=(count, 1, 3)) * 10.0 ** rng.integers(-3, 4, (count, 1, 1))
    radius = 10.0 ** rng.uniform(-4, 4, (count, 1, 1))
    n = rng.normal(size=(count, LANES, 3))
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    d = rng.normal(size=(count, LANES, 3))
    d[:, 4:8] -= (d[:, 4:8] * n[:, 4:8]).sum(axis=2, keepdims=True) * n[:, 4:8]  # tangents
    d *= 10.0 ** rng.uniform(-10, 10, (count, LANES, 1))
    far = 10.0 ** rng.uniform(-1, 5, (count, LANES, 1))
    origin = centre + radius * n * np.where(np.arange(LANES)[:, None] < 8, 1.0, far)
    d[:, 8:12] = (centre + radius * rng.normal(size=(count, 4, 3)) * 0.7 - origin[:, 8:12]) * 3
    return np.concatenate([origin, d], axis=2), np.concatenate([centre, radius], axis=2)[:, 0]


@pytest.mark.exhaustive
def test_lanes_have_the_bits_of_the_plain_test(precision, rng):
    dtype = runtime.dtype()
    rays, spheres = (x.astype(dtype) for x in rays_and_spheres(rng))
    plain, packed = np.zeros((len(rays), LANES, 4), dtype), np.zeros((len(rays), LANES, 4), dtype)
    _both(SphereLanes(1), rays, spheres, plain, packed)
    np.testing.assert_array_equal(packed[..., 1], plain[..., 1])
    met = plain[..., 1] != 0
    np.testing.assert_array_equal(packed[..., 2:][met], plain[..., 2:][met])
    is_hit = met & (plain[..., 3] > 0)
    assert (packed[..., 0][is_hit] != 0).all()  # no sphere that a ray hits is left out
    assert 0.1 < is_hit.mean() < 0.9
    assert (packed[..., 0] != 0).mean() < is_hit.mean() + 0.25  # and most of the others are
