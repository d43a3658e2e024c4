"""The triangle tests for sixteen rays at once: the bits of the plain ones, or "undecided", never anything else."""

import numpy as np
import taichi as ti
import taichi.math as tm
from probe import vec3

import taichi_tracer as tt
from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.packet_shapes import PACKET_TESTS
from taichi_tracer.fast.packets import GROUPS
from taichi_tracer.formulas.triangles import moller_trumbore, watertight

TRIANGLES = 60


@ti.kernel
def _both(
    packet_form: ti.template(),
    solve: ti.template(),
    store: ti.template(),
    intersector: ti.template(),
    rays: ti.types.ndarray(ndim=2),
    plain: ti.types.ndarray(ndim=3),
    packed: ti.types.ndarray(ndim=3),
):
    for c in range(1):
        origin = vec3(rays, 0, 0)
        for g in ti.static(range(GROUPS)):
            dx, dy, dz = lanes(0.0), lanes(0.0), lanes(0.0)
            for lane in ti.static(range(LANES)):
                dx[lane], dy[lane], dz[lane] = rays[lane, 3], rays[lane, 4], rays[lane, 5]
            store.put_rays(c, g, origin.x, origin.y, origin.z, dx, dy, dz)
        common = store.take_heading(c, store.next_heading(c), origin, intersector)
        for i in range(plain.shape[0]):
            inside, undecided, t, u, v = packet_form(store, c, 0, common, intersector.blocks, i)
            v0, v1, v2 = intersector.blocks.triangle(i)
            for lane in ti.static(range(LANES)):
                packed[i, lane, 0], packed[i, lane, 1] = ti.cast(inside[lane], ti.i32), ti.cast(undecided[lane], ti.i32)
                packed[i, lane, 2], packed[i, lane, 3], packed[i, lane, 4] = t[lane], u[lane], v[lane]
                is_in, t0, u0, v0_, det = solve(origin, vec3(rays, lane, 3), v0, v1, v2)
                plain[i, lane, 0] = ti.cast(is_in and det != 0, ti.i32)
                plain[i, lane, 1], plain[i, lane, 2], plain[i, lane, 3] = t0, u0, v0_


def test_every_test_of_the_package_has_lanes_and_others_have_none():
    assert set(PACKET_TESTS) == {watertight, moller_trumbore}
    assert PACKET_TESTS.get(lambda *_: None) is None


def test_a_triangle_test_of_ones_own_goes_ray_by_ray(f32):
    @ti.func
    def never(o, d, v0, v1, v2):
        return False, tm.inf, 0.0, 0.0, 1.0

    from taichi_tracer.formulas.triangles import TriangleTest

    scene = tt.scene_from_mesh(np.eye(3), [[0, 1, 2]], triangle_test=TriangleTest("never", never))
    assert scene.ray_intersector.solve_packet is None
    assert not scene.intersect([1, 1, 1], [-1, -1, -1]).is_hit[0]
