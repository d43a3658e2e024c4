"""A bounding volume hierarchy for readers: a binary tree of boxes, built with the surface-area heuristic.

A ray that misses a box misses everything in it. The tree is built in numpy, from the root down. At each node, the
primitives are divided into two sets, where the expected cost of a ray is smallest (MacDonald & Booth, "Heuristics for
ray tracing using space subdivision", 1990). A ray goes down the tree with a stack of the nodes that it still has to
visit.
"""

import numpy as np
import taichi as ti

from taichi_tracer.formulas.boxes import box_interval
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Geometry
from taichi_tracer.ray import no_hit
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.registry import register
from taichi_tracer.system.seams import seams

MOST_IN_A_LEAF = 4  # primitives; a node with more of them is always divided
STACK_STEP = 64  # the stack has a multiple of this length, so that most meshes need no other kernel
COST_OF_BOX = 1.0  # the cost of testing a box, in units of the cost of testing a triangle


@register
@ti.data_oriented
@seams()
class BVHRayIntersector(RayIntersector):
    """Tries only primitives whose boxes the ray meets. Its answers equal those of ``BruteForceRayIntersector`` exactly.

    Node i has the box ``low[i]``, ``high[i]``. An inner node has ``count[i]`` = 0 and its children are ``first[i]`` and
    ``first[i]`` + 1; a leaf has the primitives ``order[first[i]]`` … ``order[first[i] + count[i] − 1]``.
    """

    name = "bvh"

    def bind(self, geometry: Geometry, triangle_test: str | TriangleTest = "watertight") -> None:
        """Build the tree over the primitives that a ray can hit."""
        super().bind(geometry, triangle_test)
        nodes, order, depth = self.trees(geometry)
        self.num_nodes, self.stack_size = len(nodes), -(-(depth + 1) // STACK_STEP) * STACK_STEP
        self._memory = memory.Memory()
        self.low, self.high = ti.Vector.field(3, float), ti.Vector.field(3, float)
        self.first, self.count, self.order = ti.field(ti.i32), ti.field(ti.i32), ti.field(ti.i32)
        self._memory.fields.dense(ti.i, len(nodes)).place(self.low, self.high, self.first, self.count)
        self._memory.fields.dense(ti.i, max(1, len(order))).place(self.order)
        self._memory.allocate()
        box = np.array([node[0] for node in nodes], runtime.dtype())
        links = np.array([node[1:] for node in nodes], np.int32)
        self._load(box, links, order.astype(np.int32))

    def trees(self, geometry: Geometry) -> tuple[list, np.ndarray, int]:
        """([(box, first, count), …], what is in the leaves, the depth) of the tree over all primitives."""
        ids, boxes = geometry.hittable()
        nodes, order, depth = build(boxes)
        return nodes, ids[order], depth

    def destroy(self) -> None:
        """Free the tree's memory."""
        self._memory.free()

    def facts(self) -> dict[str, str]:
        """What ``taichi-tracer info`` prints about the tree."""
        return {"nodes": f"{self.num_nodes:,}", "stack": f"{self.stack_size}"}

    @ti.kernel
    def _load(self, box: ti.types.ndarray(ndim=2), links: ti.types.ndarray(ndim=2), order: ti.types.ndarray(ndim=1)):
        for i in range(box.shape[0]):
            for k in ti.static(range(3)):
                self.low[i][k], self.high[i][k] = box[i, k], box[i, k + 3]
            self.first[i], self.count[i] = links[i, 0], links[i, 1]
        for i in range(order.shape[0]):
            self.order[i] = order[i]

    @ti.func
    def node_interval(self, bounds, node, t_min, t_max):
        """``box_interval`` of a node's box: (t_near, t_far), of which the first is larger if the ray misses the box."""
        return box_interval(bounds, self.low[node], self.high[node], t_min, t_max)

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        """As in the base class: the nearest hit, with the lowest id among equal ones; or any hit, with ``any_hit``."""
        nearest, best = no_hit(), t_max
        bounds = self.ray_bounds(ray)
        stack = ti.Vector([0] * self.stack_size, ti.i32)
        waiting = ti.cast(self.is_legal(ray), ti.i32)  # 1: the root, node 0, waits on the stack
        while waiting > 0:
            waiting -= 1
            node = stack[waiting]
            t_near, t_far = self.node_interval(bounds, node, t_min, best)
            if t_near <= t_far:
                if self.count[node] == 0:
                    stack[waiting], stack[waiting + 1] = self.first[node] + 1, self.first[node]
                    waiting += 2
                for i in range(self.first[node], self.first[node] + self.count[node]):
                    hit = self.intersect_primitive(ray, self.order[i], t_min)
                    if hit.is_hit and t_min < hit.distance:
                        is_first_of_equals = hit.distance == best and hit.triangle_id < nearest.triangle_id
                        if hit.distance < best or is_first_of_equals:
                            nearest, best = hit, hit.distance
                if ti.static(any_hit):
                    if nearest.is_hit:
                        waiting = 0
        return nearest


def build(boxes: np.ndarray) -> tuple[list, np.ndarray, int]:
    """([(box, first, count), …], the order of the items, the depth) of a tree over (n, 6) boxes."""
    order, depth = np.arange(len(boxes)), 0
    nodes: list = [None]
    tasks = [(0, 0, len(boxes), 1)]  # node, its range of ``order``, its depth
    while tasks:
        node, begin, end, level = tasks.pop()
        inside, depth = boxes[order[begin:end]], max(depth, level)
        bounds = np.concatenate([inside[:, :3].min(axis=0, initial=np.inf), inside[:, 3:].max(axis=0, initial=-np.inf)])
        middle = begin
        if end - begin > 1:
            left, by_axis = cheapest_cut(inside)
            if end - begin > MOST_IN_A_LEAF or left > 0:
                order[begin:end] = order[begin:end][by_axis]
                middle = begin + (left if left > 0 else (end - begin) // 2)
        if middle == begin:
            nodes[node] = (bounds, begin, end - begin)
        else:
            nodes[node] = (bounds, len(nodes), 0)
            tasks += [(len(nodes), begin, middle, level + 1), (len(nodes) + 1, middle, end, level + 1)]
            nodes += [None, None]
    return nodes, order, depth


def cheapest_cut(boxes: np.ndarray) -> tuple[int, np.ndarray]:
    """(number of boxes on the left side, order of the boxes along the best axis); the number is 0 if a leaf is cheaper.

    The cost of a cut is the cost of one more box test, plus the cost of each side's triangles times the probability
    that a ray through the node also meets that side. This probability is the ratio of the two surface areas.
    """
    best_cost, best = len(boxes) * half_area(boxes.min(axis=0)[:3], boxes.max(axis=0)[3:]), 0
    centre = boxes[:, :3] + boxes[:, 3:]
    best_order = np.argsort(centre[:, np.ptp(centre, axis=0).argmax()], kind="stable")
    count = np.arange(1, len(boxes))
    for axis in range(3):
        by_axis = np.argsort(centre[:, axis], kind="stable")
        low, high = boxes[by_axis, :3], boxes[by_axis, 3:]
        left = half_area(np.minimum.accumulate(low), np.maximum.accumulate(high))[:-1]
        right = half_area(np.minimum.accumulate(low[::-1]), np.maximum.accumulate(high[::-1]))[::-1][1:]
        cost = left * count + right * count[::-1] + COST_OF_BOX * half_area(low.min(axis=0), high.max(axis=0))
        if cost.min() < best_cost:
            best_cost, best, best_order = cost.min(), int(cost.argmin()) + 1, by_axis
    return best, best_order


def half_area(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Half the surface area of boxes, in float64."""
    size = (high - low).astype(np.float64)
    return size[..., 0] * size[..., 1] + size[..., 1] * size[..., 2] + size[..., 2] * size[..., 0]
