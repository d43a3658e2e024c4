"""The triangle tests of ``formulas.triangles`` for sixteen rays at once, with the same bits."""

import taichi as ti

from taichi_tracer.fast.lanes import any_lane, lanes, larger, smaller
from taichi_tracer.formulas.triangles import moller_trumbore, stable_normal, watertight
from taichi_tracer.system import runtime


@ti.func
def packet_watertight(p: ti.template(), c, g, common, blocks: ti.template(), i):
    """``watertight`` of sixteen rays on one triangle: (is_inside, is_undecided, t, u, v), each with sixteen lanes.

    A lane is undecided if one of its edge functions is exactly 0. The plain form computes such lanes in f64.
    """
    p.x0[c, g], p.y0[c, g] = p.project(c, g, common, blocks, i, 0)
    p.x1[c, g], p.y1[c, g] = p.project(c, g, common, blocks, i, 1)
    p.x2[c, g], p.y2[c, g] = p.project(c, g, common, blocks, i, 2)
    ax, bx, cx = p.x0[c, g], p.x1[c, g], p.x2[c, g]
    ay, by, cy = p.y0[c, g], p.y1[c, g], p.y2[c, g]
    u_edge = cx * by - cy * bx
    v_edge = ax * cy - ay * cx
    w_edge = bx * ay - by * ax
    lowest, highest = smaller(u_edge, smaller(v_edge, w_edge)), larger(u_edge, larger(v_edge, w_edge))
    is_inside = (lowest >= 0) | (highest <= 0)
    is_undecided = lowest > highest  # a vector that is False in every lane
    t, u, v = lanes(0.0), lanes(0.0), lanes(0.0)
    if any_lane(is_inside):
        v0, v1, v2 = blocks.triangle(i)
        total = u_edge + v_edge + w_edge
        n = stable_normal(v0, v1, v2)
        det = -(p.d[c, g, 0] * n.x + p.d[c, g, 1] * n.y + p.d[c, g, 2] * n.z)
        ox, oy, oz = p.origin(c, g, common, 0), p.origin(c, g, common, 1), p.origin(c, g, common, 2)
        t = -((v0.x - ox) * n.x + (v0.y - oy) * n.y + (v0.z - oz) * n.z) / det
        u, v = v_edge / total, w_edge / total
        if ti.static(runtime.can_widen()):
            is_undecided = is_inside & ((u_edge == 0) | (v_edge == 0) | (w_edge == 0))
            is_inside = is_inside & (u_edge != 0) & (v_edge != 0) & (w_edge != 0)
        is_inside = is_inside & (total != 0) & (det != 0)
    return is_inside, is_undecided, t, u, v


@ti.func
def packet_moller_trumbore(p: ti.template(), c, g, common, blocks: ti.template(), i):
    """``moller_trumbore`` of sixteen rays on one triangle; it returns the same as ``packet_watertight``."""
    v0, v1, v2 = blocks.triangle(i)
    e1 = v1 - v0
    e2 = v2 - v0
    dx, dy, dz = p.d[c, g, 0], p.d[c, g, 1], p.d[c, g, 2]
    ox, oy, oz = p.origin(c, g, common, 0), p.origin(c, g, common, 1), p.origin(c, g, common, 2)
    sx, sy, sz = ox - v0.x, oy - v0.y, oz - v0.z
    # d × e2 and s × e1
    px, py, pz = dy * e2.z - dz * e2.y, dz * e2.x - dx * e2.z, dx * e2.y - dy * e2.x
    qx, qy, qz = sy * e1.z - sz * e1.y, sz * e1.x - sx * e1.z, sx * e1.y - sy * e1.x

    det = e1.x * px + e1.y * py + e1.z * pz
    u = (sx * px + sy * py + sz * pz) / det
    v = (dx * qx + dy * qy + dz * qz) / det
    t = (e2.x * qx + e2.y * qy + e2.z * qz) / det

    is_inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (det != 0)
    return is_inside, det != det, t, u, v


PACKET_TESTS = {watertight: packet_watertight, moller_trumbore: packet_moller_trumbore}


def packet_test(solve):
    """The packet form of a triangle test; None if it has none."""
    return PACKET_TESTS.get(solve)
