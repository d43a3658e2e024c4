"""A bounding volume hierarchy with eight children per node, and its traversal by single rays and by packets.

In memory, the first planes of all eight boxes are neighbours, then the second planes, and so on. Therefore a CPU tests
the eight boxes at once (Wald, Benthin & Boulos, "Getting rid of packets", RT 2008). A plane is stored as a byte, see
``bvh_wide.Grid``.
"""

import time

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast import bvh_build
from taichi_tracer.fast.bvh_build import BLOCK, BLOCK_BITS
from taichi_tracer.fast.bvh_wide import WIDTH, WideTree, collapse, empty_tree, quantise
from taichi_tracer.fast.lanes import first_lane, lanes_of, larger, smaller
from taichi_tracer.fast.leaf_blocks import (
    NO_ROW,
    LeafBlocks,
    aim_of,
    in_blocks,
    leaf_range,
    leaf_triangles,
    primitives_at_once,
)
from taichi_tracer.fast.leaf_search import LeafSearch
from taichi_tracer.fast.packet_shapes import PACKET_TESTS
from taichi_tracer.fast.packets import slab
from taichi_tracer.geometry import MANY_TRIANGLES, Geometry
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.ray import no_hit
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.blocks import in_own_block
from taichi_tracer.system.seams import element, in_kernels, seams, variable
from taichi_tracer.system.tables import Tables
from taichi_tracer.system.varying import varying

NOTHING = -(1 << 31)  # a reference to neither a node nor a leaf
# Stacks have a multiple of this length, and depths are rounded up, so that most trees have the same kernels.
STACK_STEP, DEPTH_STEP = 64, 8
UNBRANCHED = 2  # children that are put on the stack without a branch: few rays meet more, besides the one they enter


@ti.data_oriented
@seams()
class WideBVH(LeafSearch):
    """Tries only triangles whose boxes the ray meets, nearest box first. The answers equal those of brute force."""

    name, form, stands_in_for = "bvh", "hierarchy of eight boxes a node", BVHRayIntersector

    def bind(self, geometry: Geometry, triangle_test="watertight") -> None:
        """Build the tree over the primitives that a ray can hit."""
        super().bind(geometry, triangle_test)
        self.solve_packet = PACKET_TESTS.get(self.solve)  # None if the test has no form for packets
        start = time.perf_counter()
        ids, order, wide, roots = self.trees(geometry)
        references, places = self.in_blocks(np.append(wide.children, roots).astype(np.int32), len(ids))
        children, self.roots = references[: -len(roots)].reshape(-1, WIDTH), references[-len(roots) :]
        self.root, self.depth = varying(int(self.roots[0])), -(-wide.depth // DEPTH_STEP) * DEPTH_STEP
        self.stack_size = -(-wide.stack_size // STACK_STEP) * STACK_STEP
        self.is_one_leaf = self.root < 0  # of a scene with few primitives: kernels have no code for nodes
        self.num_nodes, self.num_leaf_triangles, self.cost = len(wide.children), len(ids), wide.cost
        self.num_places = BLOCK * -(-(int(places.max(initial=-1)) + 1) // BLOCK)

        grid = quantise(wide.planes)
        del wide  # before the fields are made, which need as much memory
        self._memory = memory.Memory()
        self.corner, self.step = ti.Vector.field(3, float), ti.Vector.field(3, float)
        self.number_type = ti.u8 if runtime.has_f64() else ti.i32  # some Vulkan devices have no bytes
        self.numbers = ti.Vector.field(WIDTH, self.number_type)
        self.children = ti.field(ti.i32)
        # The fields are nested, so that the memory of a node is contiguous.
        node = self._memory.fields.dense(ti.i, self.num_nodes)
        node.place(self.corner, self.step)
        node.dense(ti.j, 6).place(self.numbers)
        node.dense(ti.j, WIDTH).place(self.children)
        self.blocks = self.blocks_of(geometry)
        self._memory.allocate()
        number_type = np.uint8 if self.number_type == ti.u8 else np.int32
        nodes = grid.corner, grid.step, grid.numbers.astype(number_type, copy=False), children
        rows = np.full(self.num_places, NO_ROW, np.int32)
        rows[places] = order
        triangles = *leaf_triangles(geometry), ids
        if len(ids) < MANY_TRIANGLES:
            tables = Tables()
            for field, array in zip((self.corner, self.step, self.numbers, self.children), nodes, strict=True):
                tables.put(field, array)
            self.blocks.put(tables, rows, *triangles)
            tables.load(self._memory)
        else:
            self._load(*nodes, *triangles, rows)
        self.build_seconds = time.perf_counter() - start

    def trees(self, geometry: Geometry) -> tuple[np.ndarray, np.ndarray, WideTree, np.ndarray]:
        """What ``hittable`` lists, the order of its rows in the leaves, the nodes, and the reference to their root."""
        ids, boxes = geometry.hittable()
        if len(ids) == 0:
            wide = empty_tree(runtime.dtype())
            return ids, np.zeros(0, np.int32), wide, np.array([wide.root])
        tree = bvh_build.build(boxes, primitives_at_once(self.solve, geometry.effects.spheres))
        del boxes  # of a large mesh, all of these together would need the memory of the whole scene once more
        wide = collapse(tree)
        return ids, tree.order, wide, np.array([wide.root])

    def in_blocks(self, references: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """``leaf_blocks.in_blocks`` of all references to leaves of primitives."""
        return in_blocks(references, count)

    def blocks_of(self, geometry: Geometry) -> LeafBlocks:
        """The memory of the leaves."""
        return LeafBlocks(self._memory.fields, self.num_places, self.solve, geometry.effects.spheres)

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

    @ti.kernel
    def _load(
        self,
        corner: ti.types.ndarray(ndim=2),
        step: ti.types.ndarray(ndim=2),
        numbers: ti.types.ndarray(ndim=3),
        children: ti.types.ndarray(ndim=2),
        vertices: ti.types.ndarray(ndim=2),
        faces: ti.types.ndarray(ndim=2),
        ids: ti.types.ndarray(ndim=1),
        rows: ti.types.ndarray(ndim=1),
    ):
        num_nodes, num_blocks = numbers.shape[0], rows.shape[0] // BLOCK
        for i in range(ti.max(num_nodes, num_blocks)):  # one loop for both, which Taichi translates as one piece
            if i < num_nodes:
                for k in range(3):
                    self.corner[i][k], self.step[i][k] = corner[i, k], step[i, k]
                for plane in range(6):
                    for k in range(WIDTH):
                        self.numbers[i, plane][k] = ti.cast(numbers[i, plane, k], self.number_type)
                for k in range(WIDTH):
                    self.children[i, k] = children[i, k]
            if i < num_blocks:
                self.blocks.fill(i, rows, vertices, faces, ids)

    @ti.func
    def nearest(self, ray, t_min, t_max):
        """(t, id, u, v) of the nearest hit with t_min < t < t_max, lowest id if equal; else (t_max, −1, 0, 0)."""
        t, primitive_id, u, v, _ = self.nearest_place(ray, t_min, t_max)
        return t, primitive_id, u, v

    @ti.func
    def nearest_place(self, ray, t_min, t_max):
        """``nearest``, and the place of the hit primitive, see ``leaf_blocks``; 0 if nothing is hit."""
        bounds, aim = self.ray_bounds(ray), aim_of(ray)
        best, best_id, best_u, best_v, best_place = t_max, -1, 0.0, 0.0, 0
        if ti.static(self.is_one_leaf):
            if self.is_legal(ray):
                best, best_id, best_u, best_v, best_place = self.search_leaf(
                    self.root, ray, bounds, aim, t_min, best, best_id, best_u, best_v, best_place
                )
        else:
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
                    following, top = self.enter(waiting, waiting_t, top, reference, t_near, mask, UNBRANCHED)
                else:
                    best, best_id, best_u, best_v, best_place = self.search_leaf(
                        reference, ray, bounds, aim, t_min, best, best_id, best_u, best_v, best_place
                    )
                if following == NOTHING:
                    following, top = self.wake(waiting, waiting_t, top, best)
                reference = following
        return best, best_id, best_u, best_v, best_place

    @ti.func
    def is_blocked(self, ray, t_min, t_max):
        """Whether anything is hit with t_min < t < t_max.

        The search ends at the first hit. Therefore the children of a node are not sorted by their distance: that would
        take more time than it saves.
        """
        bounds, aim = self.ray_bounds(ray), aim_of(ray)
        blocked = False
        if ti.static(self.is_one_leaf):
            if self.is_legal(ray):
                blocked = self.blocks_in_leaf(self.root, ray, bounds, aim, t_min, t_max)
        else:
            waiting = ti.Vector([0] * self.stack_size, ti.i32)
            top = 0
            reference = NOTHING
            if self.is_legal(ray):
                reference = self.root
            while reference != NOTHING:
                following = NOTHING
                if reference >= 0:
                    _, mask = self.met_children(bounds, reference, t_min, t_max)
                    following, top = self.enter_any(waiting, top, reference, mask)
                elif self.blocks_in_leaf(reference, ray, bounds, aim, t_min, t_max):
                    blocked = True
                elif top > 0:
                    top -= 1
                    following = waiting[top]
                reference = following
        return blocked

    @ti.func
    def query_segment(self, ray, t_min, t_max):
        """HitData of the nearest hit with t_min < t < t_max. Its triangle is read where the search has just read it."""
        t, primitive_id, u, v, place = self.nearest_place(ray, t_min, t_max)
        hit = no_hit()
        if primitive_id >= 0:
            v0, v1, v2 = self.blocks.triangle(place)
            hit = self.describe_met(ray, t, primitive_id, u, v, v0, v1, v2, t_min, t_max)
        return hit

    @ti.func
    def enter_any(self, waiting: ti.template(), top, node, mask):
        """(a child that the ray meets, the new top of the stack). The other children wait.

        If the ray meets no child, the last one that waits is entered; ``NOTHING`` if none waits. How many children a
        ray meets is a branch that the CPU cannot predict. Therefore a few are always written, and whatever is no child
        is overwritten later.
        """
        is_met, first = mask != 0, self.child(node, mask)
        mask &= mask - 1
        for _ in ti.static(range(UNBRANCHED)):
            waiting[top] = self.child(node, mask)
            top += ti.select(mask != 0, 1, 0)
            mask &= mask - 1
        while mask != 0:
            waiting[top] = self.child(node, mask)
            top += 1
            mask &= mask - 1
        top -= ti.select(is_met, 0, 1)
        following = NOTHING
        if top >= 0:
            following = ti.select(is_met, first, waiting[top])
        return following, top

    @ti.func
    def child(self, node, mask):
        """The first child of a mask, see ``lanes_of``; any child if the mask is empty."""
        return self.children[node, ti.min(first_lane(mask), WIDTH - 1)]

    @ti.func
    def enter(self, waiting: ti.template(), waiting_t: ti.template(), top, node, t_near, mask, few: ti.template()):
        """(the nearest child that the ray meets, or ``NOTHING``; the new top of the stack). The other children wait.

        The box of an absent child is inside out. A ray can still meet it, if the node is smaller than the padding of
        the ray; but an absent child is an empty leaf.

        Args:
            few: how many children are written to the stack without a branch, see ``enter_any``; packets need none.
        """
        nearest = NOTHING
        if mask != 0:
            k = first_lane(mask)
            mask &= mask - 1
            nearest = self.children[node, k]
            nearest_t = t_near[k]
            for _ in ti.static(range(few)):
                k = ti.min(first_lane(mask), WIDTH - 1)
                child, t = self.children[node, k], ti.select(mask != 0, t_near[k], tm.inf)
                is_nearer = t < nearest_t
                waiting[top] = ti.select(is_nearer, nearest, child)
                waiting_t[top] = ti.select(is_nearer, nearest_t, t)
                top += ti.select(mask != 0, 1, 0)
                mask &= mask - 1
                nearest = ti.select(is_nearer, child, nearest)
                nearest_t = ti.select(is_nearer, t, nearest_t)
            while mask != 0:  # the same for children that exist for certain, in fewer operations
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

    @ti.func
    def wake(self, waiting: ti.template(), waiting_t: ti.template(), top, best):
        """(the last waiting reference that is met before ``best``, or ``NOTHING``; the new top of the stack)."""
        following = NOTHING
        while following == NOTHING and top > 0:
            top -= 1
            if waiting_t[top] <= best:
                following = waiting[top]
        return following, top

    @in_kernels
    def near_and_far_plane(self, node, axis, is_forward):
        """The planes of the eight boxes of a node, along an axis, through which rays enter and leave."""
        places = ti.select(is_forward, axis, axis + 3), ti.select(is_forward, axis + 3, axis)
        corner, step = (variable(element(element(field, node), axis)) for field in (self.corner, self.step))
        near, far = (ti.cast(element(self.numbers, node, place), float) for place in places)
        return variable(corner + near * step), variable(corner + far * step)

    @ti.func
    @in_own_block(2)
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

    @ti.func
    def trace_packet(self, packets: ti.template(), c, origin, t_min):
        """``nearest`` for the rays of a packet, one heading after the other. The hits are stored in the packet."""
        heading = 0
        while heading >= 0:
            heading = packets.next_heading(c)
            if heading >= 0:
                common = packets.take_heading(c, heading, origin, self)
                self.trace_heading(packets, c, common, t_min)

    @ti.func
    def trace_heading(self, packets: ti.template(), c, common, t_min):
        """``nearest`` for all rays of a heading together: into every box that at least one of them may meet."""
        best, fetched = packets.farthest(c), 0.0
        waiting = ti.Vector([0] * self.stack_size, ti.i32)
        waiting_t = ti.Vector([0.0] * self.stack_size, float)
        top = 0
        reference = self.root
        while reference != NOTHING:
            following = NOTHING
            if reference >= 0:
                t_near, mask = self.children_met_by_any(common, reference, t_min, best)
                fetched += self.fetch_leaves(reference, mask)
                # The rays of neighbouring packets meet about as many children: these branches can be predicted.
                following, top = self.enter(waiting, waiting_t, top, reference, t_near, mask, 0)
            else:
                first, count = leaf_range(reference)
                packets.try_leaf(c, common, self, first, count, t_min)
                best = packets.farthest(c)
            if following == NOTHING:
                following, top = self.wake(waiting, waiting_t, top, best)
            reference = following
        packets.fetched[c][0] = fetched

    @ti.func
    def fetch_leaves(self, node, mask):
        """Read a coordinate and an id of each leaf's first block, for the leaves among some of the children.

        The memory of all these leaves is then on its way to the processor at the same time, before the first of them
        is tried. The result has no meaning, but it must be stored: a read whose result is not used is left out.
        """
        fetched = 0.0
        while mask != 0:
            child = self.children[node, first_lane(mask)]
            mask &= mask - 1
            first, _ = leaf_range(ti.min(child, -1))  # a node counts as an empty leaf: it reads block 0
            block = first >> BLOCK_BITS
            fetched += self.blocks.vertices[block, 0][0] + self.blocks.ids[block, 0]
        return fetched

    @ti.func
    @in_own_block(2)
    def children_met_by_any(self, common, node, t_min, t_max):
        """``met_children`` for all rays between the extremes of ``common``."""
        t_near, t_far = ti.Vector([t_min] * WIDTH), ti.Vector([t_max] * WIDTH)
        for k in ti.static(range(3)):
            near_plane, far_plane = self.near_and_far_plane(node, k, (common.heading >> k) & 1 == 0)
            to_near, to_far = near_plane - common.near_origin[k], far_plane - common.far_origin[k]
            low, high = ti.Vector([common.low[k]] * WIDTH), ti.Vector([common.high[k]] * WIDTH)
            t_near, t_far = slab(to_near, to_far, low, high, t_near, t_far)
        return t_near, lanes_of(t_near <= t_far)
