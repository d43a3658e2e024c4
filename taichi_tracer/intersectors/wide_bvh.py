"""A bounding volume hierarchy with eight children per node, and its traversal.

In memory, the first planes of all eight boxes are neighbours, then the second planes, and so on. Therefore a CPU tests
the eight boxes at once (Wald, Benthin & Boulos, "Getting rid of packets", RT 2008). A plane is stored as a byte, see
``bvh_wide.quantise``.
"""

import time

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.geometry import Geometry
from taichi_tracer.intersectors import bvh_build
from taichi_tracer.intersectors.bvh_build import BLOCK, BLOCK_BITS
from taichi_tracer.intersectors.bvh_wide import WIDTH, collapse, quantise
from taichi_tracer.intersectors.lanes import first_lane, lanes_of, larger, smaller
from taichi_tracer.intersectors.leaf_blocks import (
    NO_ROW,
    LeafBlocks,
    aim_of,
    in_blocks,
    is_inside,
    leaf_range,
    leaf_triangles,
    may_be_inside,
    may_pass_inside,
    primitives_at_once,
)
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.compile_time import compile_time, element, variable
from taichi_tracer.system.parts import overridable, register

NOTHING = -(1 << 31)  # a reference to neither a node nor a leaf
STACK_STEP = 64  # the stack has a multiple of this length, so that most trees have the same kernels
# Children that a shadow ray puts on the stack without a branch: few rays meet more, besides the one they enter.
UNBRANCHED = 2


@register
@ti.data_oriented
@overridable()
class WideBVH(RayIntersector):
    """Tries only triangles whose boxes the ray meets, nearest box first. The answers equal those of brute force."""

    name = "wide_bvh"

    def bind(self, geometry: Geometry, triangle_test="watertight") -> None:
        """Build the tree over the primitives that a ray can hit."""
        super().bind(geometry, triangle_test)
        start = time.perf_counter()
        ids, boxes = geometry.hittable()
        tree = bvh_build.build(boxes, primitives_at_once(self.solve, geometry.effects.spheres))
        order, wide = tree.order, collapse(tree)
        del boxes, tree  # of a large mesh, these would need the memory of the whole scene once more
        references, places = in_blocks(np.append(wide.children, wide.root).astype(np.int32), len(ids))
        children, self.root = references[:-1].reshape(-1, WIDTH), memory.varying(int(references[-1]))
        # On the way down, all children of a node wait but the one that is entered: see ``enter``.
        self.depth, waiting = wide.depth, 1 + (WIDTH - 1) * wide.depth
        self.stack_size = -(-waiting // STACK_STEP) * STACK_STEP
        self.num_nodes, self.num_leaf_triangles, self.cost = len(wide.children), len(ids), wide.cost
        self.num_places = BLOCK * -(-(int(places.max(initial=-1)) + 1) // BLOCK)

        corner, step, numbers = quantise(wide.planes)
        del wide  # before the fields are made, which need as much memory
        self._memory = memory.Memory()
        self.corner, self.step = ti.Vector.field(3, float), ti.Vector.field(3, float)
        self.number_type = ti.u8 if runtime.can("f64") else ti.i32  # some Vulkan devices have no bytes
        self.numbers = ti.Vector.field(WIDTH, self.number_type)
        self.children = ti.field(ti.i32)
        # The fields are nested, so that the memory of a node is contiguous.
        node = self._memory.fields.dense(ti.i, self.num_nodes)
        node.place(self.corner, self.step)
        node.dense(ti.j, 6).place(self.numbers)
        node.dense(ti.j, WIDTH).place(self.children)
        self.blocks = LeafBlocks(self._memory.fields, self.num_places, self.solve, geometry.effects.spheres)
        self._memory.allocate()
        self._memory.write(self.corner, corner)
        self._memory.write(self.step, step)
        self._memory.write(self.numbers, numbers)
        self._memory.write(self.children, children)
        rows = np.full(self.num_places, NO_ROW, np.int32)
        rows[places] = order
        self.blocks.load(self._memory, rows, *leaf_triangles(geometry), ids)
        self.build_seconds = time.perf_counter() - start

    @property
    def bytes(self) -> int:
        """The memory of the nodes and of the blocks of triangles."""
        scalar, number = np.dtype(runtime.dtype()).itemsize, 1 if self.number_type == ti.u8 else 4
        return self.num_nodes * (6 * scalar + WIDTH * (6 * number + 4)) + self.num_places * (9 * scalar + 4)

    def facts(self) -> dict[str, str]:
        """What ``taichi-tracer info`` prints about the tree."""
        per_triangle = self.bytes / max(1, self.num_leaf_triangles)
        return {
            "nodes": f"{self.num_nodes:,}",
            "depth": f"{self.depth}",
            "SAH cost": f"{self.cost:.1f} tests of four triangles for a ray that meets the bounds",
            "build time": f"{self.build_seconds:.2f} s, compiling included",
            "tree memory": f"{self.bytes:,} bytes ({per_triangle:.0f} bytes per triangle)",
        }

    def destroy(self) -> None:
        """Free the tree's memory."""
        self._memory.free()

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        """As in the base class: the nearest hit, with the lowest id among equal ones; or any hit, with ``any_hit``.

        The search for any hit ends at the first one. Therefore the children of a node are not sorted by their distance:
        that would take more time than it saves.
        """
        bounds, aim = self.ray_bounds(ray), aim_of(ray)
        best, best_id, best_u, best_v = t_max, -1, 0.0, 0.0
        waiting = ti.Vector([0] * self.stack_size, ti.i32)
        waiting_t = ti.Vector([0.0] * self.stack_size, float)
        top = 0
        reference = NOTHING
        if self.is_legal(ray):
            reference = self.root
        while reference != NOTHING:
            following = NOTHING
            if reference >= 0:
                t_near, mask = self.met_children(bounds, reference, t_min, best)
                if ti.static(any_hit):
                    following, top = self.enter_any(waiting, top, reference, mask)
                else:
                    following, top = self.enter(waiting, waiting_t, top, reference, t_near, mask)
            else:
                best, best_id, best_u, best_v = self.search_leaf(
                    reference, ray, bounds, aim, t_min, best, best_id, best_u, best_v
                )
                if ti.static(any_hit):
                    if best_id >= 0:
                        top = 0
            while following == NOTHING and top > 0:  # go on with the last child that waits and is met before ``best``
                top -= 1
                if ti.static(any_hit) or waiting_t[top] <= best:
                    following = waiting[top]
            reference = following
        return self.found(ray, best, best_id, best_u, best_v, any_hit)

    @ti.func
    def enter_any(self, waiting: ti.template(), top, node, mask):
        """(a child that the ray meets, or ``NOTHING``; the new top of the stack). The other children wait.

        How many children a ray meets is a branch that the CPU cannot predict. Therefore a few are always written, and
        whatever is no child is overwritten later.
        """
        first = ti.select(mask != 0, self.child(node, mask), NOTHING)
        mask &= mask - 1
        for _ in ti.static(range(UNBRANCHED)):
            waiting[top] = self.child(node, mask)
            top += ti.select(mask != 0, 1, 0)
            mask &= mask - 1
        while mask != 0:
            waiting[top] = self.child(node, mask)
            top += 1
            mask &= mask - 1
        return first, top

    @ti.func
    def child(self, node, mask):
        """The first child of a mask, see ``lanes_of``; any child if the mask is empty."""
        return self.children[node, ti.min(first_lane(mask), WIDTH - 1)]

    @ti.func
    def enter(self, waiting: ti.template(), waiting_t: ti.template(), top, node, t_near, mask):
        """(the nearest child that the ray meets, or ``NOTHING``; the new top of the stack). The other children wait.

        The box of an absent child is inside out. A ray can still meet it, if the node is smaller than the padding of
        the ray; but an absent child is an empty leaf.
        """
        nearest = NOTHING
        if mask != 0:
            k = first_lane(mask)
            mask &= mask - 1
            nearest = self.children[node, k]
            nearest_t = t_near[k]
            while mask != 0:
                k = first_lane(mask)
                mask &= mask - 1
                child, t = self.children[node, k], t_near[k]
                is_nearer = t < nearest_t
                waiting[top] = ti.select(is_nearer, nearest, child)
                waiting_t[top] = ti.select(is_nearer, nearest_t, t)
                top += 1
                nearest = ti.select(is_nearer, child, nearest)
                nearest_t = ti.select(is_nearer, t, nearest_t)
        return nearest, top

    @compile_time
    def near_and_far_plane(self, node, axis, is_forward):
        """The planes of the eight boxes of a node, along an axis, through which rays enter and leave."""
        places = ti.select(is_forward, axis, axis + 3), ti.select(is_forward, axis + 3, axis)
        corner, step = (variable(element(element(field, node), axis)) for field in (self.corner, self.step))
        near, far = (ti.cast(element(self.numbers, node, place), float) for place in places)
        return variable(corner + near * step), variable(corner + far * step)

    @ti.func
    def met_children(self, bounds, node, t_min, t_max):
        """(t where the ray enters each of the eight boxes of a node, ``lanes_of`` the boxes that it meets).

        For each box, the arithmetic is that of ``box_interval``. If a box is not met, its t has no meaning.
        """
        t_near, t_far = ti.Vector([t_min] * WIDTH), ti.Vector([t_max] * WIDTH)
        for k in ti.static(range(3)):
            is_forward = bounds.inverse[k] >= 0
            near_plane, far_plane = self.near_and_far_plane(node, k, is_forward)
            near = (near_plane - bounds.near_origin[k]) * bounds.inverse[k]
            far = (far_plane - bounds.far_origin[k]) * bounds.inverse[k]
            t_near, t_far = larger(near, t_near), smaller(far, t_far)
        return t_near, lanes_of(t_near <= t_far)

    @property
    def solves_blocks(self) -> bool:
        """Whether the triangles of a block are solved at once."""
        effects = self.geometry.effects
        return self.blocks.test is may_pass_inside and not (effects.spheres or effects.culling or effects.holes)

    @ti.func
    def search_leaf(self, reference, ray, bounds, aim, t_min, best, best_id, best_u, best_v):
        """The nearest hit in a leaf, if it is nearer than the best one so far, which is given; otherwise that one."""
        first, count = leaf_range(reference)
        for block in range(first >> BLOCK_BITS, (first + count + BLOCK - 1) >> BLOCK_BITS):
            if ti.static(self.solves_blocks):
                u_edge, v_edge, w_edge = self.blocks.edges(aim, block)
                mask = lanes_of(may_be_inside(u_edge, v_edge, w_edge))
                if mask != 0:
                    distances = self.blocks.distances(ray, bounds, aim, block)
                    while mask != 0:
                        lane = first_lane(mask)
                        place = (block << BLOCK_BITS) + lane
                        mask &= mask - 1
                        primitive_id, t = self.blocks.primitive(place), distances[lane]
                        t, u, v, w = self.solved(ray, aim, place, u_edge[lane], v_edge[lane], w_edge[lane], t)
                        if t_min < t and (t < best or (t == best and primitive_id < best_id)):
                            total = u + v + w
                            best, best_id, best_u, best_v = t, primitive_id, v / total, w / total
            else:
                used = ti.min(first + count - (block << BLOCK_BITS), BLOCK)
                mask = self.blocks.candidates(ray, aim, block, used)
                while mask != 0:
                    place = (block << BLOCK_BITS) + first_lane(mask)
                    mask &= mask - 1
                    primitive_id = self.blocks.primitive(place)
                    t, u, v = self.try_at(place, ray, bounds, t_min)
                    if t_min < t and (t < best or (t == best and primitive_id < best_id)):
                        best, best_id, best_u, best_v = t, primitive_id, u, v
        return best, best_id, best_u, best_v

    @ti.func
    def solved(self, ray, aim, place, u, v, w, t):
        """(t, u, v, w) of the triangle at a place, from what its block found; t is −∞ for a miss.

        Args:
            u, v, w: its edge functions, which ``may_be_inside``. Where one is 0, the exact ones are returned.
        """
        if u == 0 or v == 0 or w == 0:
            u, v, w = self.blocks.exact_edges(aim, place)
            if not is_inside(u, v, w):
                t = -tm.inf
        return t, u, v, w

    @ti.func
    def try_at(self, place, ray, bounds, t_min):
        """(t, u, v) of the triangle or the sphere at a place; t is −∞ for a miss."""
        primitive_id, corners = self.blocks.primitive(place), self.blocks.triangle(place)
        if ti.static(not self.geometry.effects.spheres):
            return self.try_corners(ray, bounds, primitive_id, primitive_id, corners, 1)
        t, u, v, index = -tm.inf, 0.0, 0.0, self.geometry.primitives[primitive_id]
        if index < 0:
            t = self.sphere_candidate(ray, bounds, -1 - index, t_min)
        else:
            t, u, v = self.try_corners(ray, bounds, primitive_id, index, corners, 1)
        return t, u, v
