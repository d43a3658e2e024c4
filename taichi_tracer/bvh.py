"""A bounding volume hierarchy, and the way of one ray through it.

The nodes have eight children (Wald, Benthin & Boulos, "Getting rid of packets", RT 2008): each of the six planes of all
eight boxes lies next to its like, so that a CPU tests the boxes at once.
"""

import time

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer import bvh_build, runtime
from taichi_tracer.bvh_wide import ABSENT, LEAF_BITS, WIDTH, collapse, empty_tree
from taichi_tracer.geometry import Geometry
from taichi_tracer.packets import PACKET_TESTS
from taichi_tracer.ray_intersector import RayIntersector


@ti.func
def leaf_range(reference):
    """First triangle and count of a leaf, see ``leaf_reference``."""
    return (-1 - reference) >> LEAF_BITS, (-1 - reference) & ((1 << LEAF_BITS) - 1)


@ti.func
def entries(t_near, t_far):
    """Where eight boxes are entered, ∞ for those that are not, and a bit for each that is."""
    entry = ti.select(t_near <= t_far, t_near, ti.Vector([tm.inf] * WIDTH))
    mask = 0
    for k in ti.static(range(WIDTH)):
        mask |= ti.cast(entry[k] < tm.inf, ti.i32) << k
    return entry, mask


@ti.data_oriented
class BVHRayIntersector(RayIntersector):
    """Tries only triangles whose boxes the ray meets, nearest box first; answers exactly as brute force does."""

    name = "bvh"

    def __init__(self, geometry: Geometry, triangle_test: str = "watertight") -> None:
        super().__init__(geometry, triangle_test)
        self.solve_packet = PACKET_TESTS.get(triangle_test)
        start = time.perf_counter()
        vertices, faces = geometry.arrays
        ids, boxes = geometry.hittable()
        corners = vertices[faces[ids]]
        order, wide = np.zeros(0, np.int32), empty_tree(runtime.dtype())
        if len(ids) > 0:
            tree = bvh_build.build(boxes)
            order, wide = tree.order, collapse(tree)
        self.root, self.depth, self.stack_size = wide.root, wide.depth, wide.stack_size
        self.num_nodes, self.num_leaf_triangles, self.cost = len(wide.children), len(ids), wide.cost

        self._memory = runtime.Memory()
        self.planes = ti.Vector.field(WIDTH, float)
        self.children = ti.field(ti.i32)
        self.leaf_vertices = ti.Vector.field(3, float)
        self.leaf_ids = ti.field(ti.i32)
        # Nested, so that all of a node, and all of a triangle, lies in one piece of memory.
        node = self._memory.fields.dense(ti.i, self.num_nodes)
        node.dense(ti.j, 6).place(self.planes)
        node.dense(ti.j, WIDTH).place(self.children)
        triangle = self._memory.fields.dense(ti.i, max(1, len(ids)))
        triangle.dense(ti.j, 3).place(self.leaf_vertices)
        triangle.place(self.leaf_ids)
        self._memory.allocate()
        self._load(wide.planes, wide.children, np.ascontiguousarray(corners[order]), ids[order].astype(np.int32))
        self.build_seconds = time.perf_counter() - start

    @property
    def bytes(self) -> int:
        """Memory of the nodes and of the triangles in the leaves' order."""
        scalar = np.dtype(runtime.dtype()).itemsize
        return self.num_nodes * WIDTH * (6 * scalar + 4) + self.num_leaf_triangles * (9 * scalar + 4)

    def facts(self) -> dict[str, str]:
        """What ``taichi-tracer info`` tells of the tree."""
        per_triangle = self.bytes / max(1, self.num_leaf_triangles)
        return {
            "nodes": f"{self.num_nodes:,}",
            "depth": f"{self.depth}",
            "SAH cost": f"{self.cost:.1f} triangle tests for a ray that meets the bounds",
            "build time": f"{self.build_seconds:.2f} s, compiling included",
            "tree memory": f"{self.bytes:,} bytes ({per_triangle:.0f} bytes per triangle)",
        }

    def destroy(self) -> None:
        """Free the tree's memory."""
        self._memory.free()

    @ti.kernel
    def _load(
        self,
        planes: ti.types.ndarray(ndim=3),
        children: ti.types.ndarray(ndim=2),
        corners: ti.types.ndarray(ndim=3),
        ids: ti.types.ndarray(ndim=1),
    ):
        for i in range(planes.shape[0]):
            for plane in range(6):
                for k in ti.static(range(WIDTH)):
                    self.planes[i, plane][k] = planes[i, plane, k]
            for k in range(WIDTH):
                self.children[i, k] = children[i, k]
        for i in range(ids.shape[0]):
            self.leaf_ids[i] = ids[i]
            for corner in ti.static(range(3)):
                for k in ti.static(range(3)):
                    self.leaf_vertices[i, corner][k] = corners[i, corner, k]

    @ti.func
    def nearest(self, ray, t_min, t_max):
        return self.traverse(ray, t_min, t_max, False)

    @ti.func
    def is_blocked(self, ray, t_min, t_max):
        t, triangle_id, u, v = self.traverse(ray, t_min, t_max, True)
        return triangle_id >= 0

    @ti.func
    def traverse(self, ray, t_min, t_max, any_hit: ti.template()):
        """(t, id, u, v) of the nearest hit, or of the first one found with ``any_hit``; t_max, −1 for none."""
        bounds = self.ray_bounds(ray)
        best, best_id, best_u, best_v = t_max, -1, 0.0, 0.0
        waiting = ti.Vector([0] * self.stack_size, ti.i32)
        waiting_t = ti.Vector([0.0] * self.stack_size, float)
        top = 0
        if self.is_legal(ray):
            waiting[0], waiting_t[0] = self.root, t_min
            top = 1
        while top > 0:
            top -= 1
            reference = waiting[top]
            if waiting_t[top] <= best:
                if reference >= 0:
                    t_near, mask = self.met_children(bounds, reference, t_min, best)
                    top = self.push(waiting, waiting_t, top, reference, t_near, mask)
                else:
                    first, count = leaf_range(reference)
                    for i in range(first, first + count):
                        v0, v1, v2 = self.leaf_vertices[i, 0], self.leaf_vertices[i, 1], self.leaf_vertices[i, 2]
                        t, u, v = -tm.inf, 0.0, 0.0
                        if ti.static(self.geometry.is_plain):
                            t, u, v = self.candidate(ray, bounds, v0, v1, v2)
                        else:
                            t, u, v = self.candidate_of(ray, bounds, self.leaf_ids[i], v0, v1, v2, t_min)
                        if t_min < t and t <= best:
                            triangle_id = self.leaf_ids[i]
                            if t < best or (triangle_id < best_id):
                                best, best_id, best_u, best_v = t, triangle_id, u, v
                    if ti.static(any_hit):
                        if best_id >= 0:
                            top = 0
        return best, best_id, best_u, best_v

    @ti.func
    def push(self, waiting: ti.template(), waiting_t: ti.template(), top, node, t_near, mask):
        """Let the children that were met wait, the nearest on top; returns the new top.

        An absent child has a box that no ray meets, but fast_math does not know infinity: it may say otherwise.
        """
        nearest_t, nearest_at = tm.inf, -1
        while mask != 0:
            k = ti.math.popcnt((mask & -mask) - 1)
            mask &= mask - 1
            child = self.children[node, k]
            if child != ABSENT:
                waiting[top], waiting_t[top] = child, t_near[k]
                if nearest_at < 0 or t_near[k] < nearest_t:
                    nearest_t, nearest_at = t_near[k], top
                top += 1
        if nearest_at >= 0:
            last = top - 1
            waiting[nearest_at], waiting[last] = waiting[last], waiting[nearest_at]
            waiting_t[nearest_at], waiting_t[last] = waiting_t[last], waiting_t[nearest_at]
        return top

    @ti.func
    def met_children(self, bounds, node, t_min, t_max):
        """Where the ray enters each of the eight boxes, and a bit for each that it meets: ``box_interval`` by lanes."""
        t_near = ti.Vector([t_min] * WIDTH)
        t_far = ti.Vector([t_max] * WIDTH)
        for k in ti.static(range(3)):
            is_forward = bounds.inverse[k] >= 0
            near = (self.planes[node, ti.select(is_forward, k, k + 3)] - bounds.near_origin[k]) * bounds.inverse[k]
            far = (self.planes[node, ti.select(is_forward, k + 3, k)] - bounds.far_origin[k]) * bounds.inverse[k]
            t_near = ti.select(near > t_near, near, t_near)
            t_far = ti.select(far < t_far, far, t_far)
        return entries(t_near, t_far)

    @ti.func
    def trace_packet(self, packets: ti.template(), c, t_min):
        """``nearest`` of the sixteen rays of a packet, one heading after the other; the answers are in the packet."""
        for lane in range(packets.count[None]):
            heading = packets.heading[c][lane]
            if heading >= 0:
                packets.take_heading(c, heading)
                self.trace_heading(packets, c, heading, t_min)
                packets.heading[c] = ti.select(packets.heading[c] == heading, -1, packets.heading[c])

    @ti.func
    def trace_heading(self, packets: ti.template(), c, heading, t_min):
        """``traverse`` of all rays of a heading: into every box that one of them can meet."""
        bounds = packets.common_bounds(c, heading)
        best = packets.farthest(c)
        waiting = ti.Vector([0] * self.stack_size, ti.i32)
        waiting_t = ti.Vector([0.0] * self.stack_size, float)
        waiting[0], waiting_t[0] = self.root, t_min
        top = 1
        while top > 0:
            top -= 1
            reference = waiting[top]
            if waiting_t[top] <= best:
                if reference >= 0:
                    t_near, mask = self.children_met_by_any(bounds, heading, reference, t_min, best)
                    top = self.push(waiting, waiting_t, top, reference, t_near, mask)
                else:
                    first, count = leaf_range(reference)
                    for i in range(first, first + count):
                        v0, v1, v2 = self.leaf_vertices[i, 0], self.leaf_vertices[i, 1], self.leaf_vertices[i, 2]
                        packets.try_primitive(c, heading, self, v0, v1, v2, self.leaf_ids[i], t_min)
                    best = packets.farthest(c)

    @ti.func
    def children_met_by_any(self, bounds, heading, node, t_min, t_max):
        """``met_children`` for all rays between the extremes of ``bounds``: never later in, never earlier out."""
        t_near = ti.Vector([t_min] * WIDTH)
        t_far = ti.Vector([t_max] * WIDTH)
        for k in ti.static(range(3)):
            is_backward = (heading >> k) & 1
            to_near = self.planes[node, k + 3 * is_backward] - bounds.near_origin[k]
            to_far = self.planes[node, k + 3 - 3 * is_backward] - bounds.far_origin[k]
            near = to_near * ti.select(to_near >= 0, bounds.low[k], bounds.high[k])
            far = to_far * ti.select(to_far >= 0, bounds.high[k], bounds.low[k])
            t_near = ti.select(near > t_near, near, t_near)
            t_far = ti.select(far < t_far, far, t_far)
        return entries(t_near, t_far)
