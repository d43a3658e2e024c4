"""The triangle tests of ``formulas.triangles`` for sixteen rays at once, with the same bits."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import any_lane, components, lanes, larger, shared, smaller
from taichi_tracer.formulas.triangles import edge_functions, moller_trumbore, stable_normal, watertight
from taichi_tracer.system import runtime


@ti.func
def rays(p: ti.template(), c, g, common):
    """Origins and directions of a group."""
    o = components(p.origin(c, g, common, 0), p.origin(c, g, common, 1), p.origin(c, g, common, 2))
    return o, components(p.d[c, g, 0], p.d[c, g, 1], p.d[c, g, 2])


@ti.func
def packet_watertight(p: ti.template(), c, g, common, blocks: ti.template(), i):
    """``watertight`` of sixteen rays on one triangle: (is_inside, is_undecided, t, u, v), each with sixteen lanes.

    A lane is undecided if one of its edge functions is exactly 0. The plain form computes such lanes in f64.
    """
    p.x0[c, g], p.y0[c, g] = p.project(c, g, common, blocks, i, 0)
    p.x1[c, g], p.y1[c, g] = p.project(c, g, common, blocks, i, 1)
    p.x2[c, g], p.y2[c, g] = p.project(c, g, common, blocks, i, 2)
    u_edge, v_edge, w_edge = edge_functions(p.x0[c, g], p.y0[c, g], p.x1[c, g], p.y1[c, g], p.x2[c, g], p.y2[c, g])
    lowest, highest = smaller(u_edge, smaller(v_edge, w_edge)), larger(u_edge, larger(v_edge, w_edge))
    is_inside = (lowest >= 0) | (highest <= 0)
    is_undecided = lowest > highest  # a vector that is False in every lane
    t, u, v = lanes(0.0), lanes(0.0), lanes(0.0)
    if any_lane(is_inside):
        v0, v1, v2 = blocks.triangle(i)
        total = u_edge + v_edge + w_edge
        o, d = rays(p, c, g, common)
        n = shared(stable_normal(v0, v1, v2))
        det = -tm.dot(d, n)
        t = -tm.dot(shared(v0) - o, n) / det
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
    o, d = rays(p, c, g, common)
    is_inside, t, u, v, det = moller_trumbore(o, d, shared(v0), shared(v1), shared(v2))
    return is_inside & (det != 0), det != det, t, u, v


PACKET_TESTS = {watertight: packet_watertight, moller_trumbore: packet_moller_trumbore}


def packet_test(solve):
    """The packet form of a triangle test; None if it has none."""
    return PACKET_TESTS.get(solve)
