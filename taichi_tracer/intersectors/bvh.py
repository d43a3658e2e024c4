"""A bounding volume hierarchy for readers: a binary tree of boxes.

A ray that misses a box misses everything in it. ``bvh_build`` makes the tree, where the expected cost of a ray is
smallest (MacDonald & Booth, "Heuristics for ray tracing using space subdivision", 1990). A ray goes down
the tree with a stack of the nodes that it still has to visit.
"""

import numpy as np
import taichi as ti

from taichi_tracer.formulas.boxes import box_interval
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Geometry
from taichi_tracer.intersectors import bvh_build
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.system import memory
from taichi_tracer.system.parts import overridable, register

STACK_STEP = 64  # the stack has a multiple of this length, so that most meshes need no other kernel


@register
@ti.data_oriented
@overridable()
class BVHRayIntersector(RayIntersector):
    """Tries only primitives whose boxes the ray meets. Its answers equal those of ``BruteForceRayIntersector`` exactly.

    Node i has the box ``low[i]``, ``high[i]``. An inner node has ``count[i]`` = 0 and its children are ``first[i]`` and
    ``first[i]`` + 1, of which the first lies lower along ``axis[i]``; a leaf has the primitives ``order[first[i]]`` …
    ``order[first[i] + count[i] − 1]``.
    """

    name = "bvh"

    def bind(self, geometry: Geometry, triangle_test: str | TriangleTest = "watertight") -> None:
        """Build the tree over the primitives that a ray can hit."""
        super().bind(geometry, triangle_test)
        box, links, order, depth = self.trees(geometry)
        self.num_nodes, self.stack_size = len(box), -(-(depth + 1) // STACK_STEP) * STACK_STEP
        self._memory, fields = memory.filled(box[:, :3], box[:, 3:], *links.T, order)
        self.low, self.high, self.first, self.count, self.axis, self.order = fields

    def trees(self, geometry: Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
        """``nodes_of`` the tree over all primitives, with their numbers in its leaves."""
        ids, boxes = geometry.hittable()
        box, links, order, depth = nodes_of(boxes)
        return box, links, ids[order], depth

    def destroy(self) -> None:
        """Free the tree's memory."""
        self._memory.free()

    def facts(self) -> dict[str, str]:
        """What ``taichi-tracer info`` prints about the tree."""
        return {"nodes": f"{self.num_nodes:,}", "stack": f"{self.stack_size}"}

    @ti.func
    def node_interval(self, bounds, node, t_min, t_max):
        """``box_interval`` of a node's box: (t_near, t_far), of which the first is larger if the ray misses the box."""
        return box_interval(bounds, self.low[node], self.high[node], t_min, t_max)

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        """As in the base class: the nearest hit, with the lowest id among equal ones; or any hit, with ``any_hit``."""
        best, best_id, best_u, best_v = t_max, -1, 0.0, 0.0
        bounds = self.ray_bounds(ray)
        stack = ti.Vector([0] * self.stack_size, ti.i32)
        waiting = ti.cast(self.is_legal(ray), ti.i32)  # 1: the root, node 0, waits on the stack
        while waiting > 0:
            waiting -= 1
            node = stack[waiting]
            t_near, t_far = self.node_interval(bounds, node, t_min, best)
            if t_near <= t_far:
                if self.count[node] == 0:  # the child that the ray meets first is on top of the stack
                    first_is_near = ti.cast(ray.direction[self.axis[node]] >= 0, ti.i32)
                    stack[waiting] = self.first[node] + first_is_near
                    stack[waiting + 1] = self.first[node] + 1 - first_is_near
                    waiting += 2
                for i in range(self.first[node], self.first[node] + self.count[node]):
                    primitive_id = self.order[i]
                    t, u, v = self.try_primitive(ray, bounds, primitive_id, t_min)
                    if t_min < t and (t < best or (t == best and primitive_id < best_id)):
                        best, best_id, best_u, best_v = t, primitive_id, u, v
                if ti.static(any_hit):
                    if best_id >= 0:
                        waiting = 0
        return self.found(ray, best, best_id, best_u, best_v, any_hit)


def nodes_of(boxes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """((N, 6) boxes, (N, 3) first, count and axis of nodes, the order of the items, the depth) over (n, 6) boxes."""
    tree = bvh_build.build(boxes, at_once=1)
    is_inner = tree.child >= 0
    links = np.stack([tree.begin, tree.end - tree.begin, np.zeros_like(tree.begin)], axis=1).astype(np.int32)
    child = tree.child[is_inner]
    left, right = tree.box[child], tree.box[child + 1]
    links[is_inner, 0], links[is_inner, 1] = child, 0
    links[is_inner, 2] = (right[:, :3] + right[:, 3:] - (left[:, :3] + left[:, 3:])).argmax(axis=1)
    return tree.box, links, tree.order, len(tree.levels) - 1
