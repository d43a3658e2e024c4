"""The search of a ray in a leaf, block after block of four triangles.

With the watertight test, all four triangles of a block are solved at once, if the ray passes any of them on the inside.
With other tests, and where there are spheres or triangles that rays may pass, the plain test tries each primitive that
the ray may hit. The answers have the same bits.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.bvh_build import BLOCK, BLOCK_BITS
from taichi_tracer.fast.lanes import first_lane, lanes_of, larger, smaller
from taichi_tracer.fast.leaf_blocks import LeafBlocks, is_inside, leaf_range, may_be_inside
from taichi_tracer.fast.nearest import FastIntersector
from taichi_tracer.system.seams import seams


@ti.data_oriented
@seams()
class LeafSearch(FastIntersector):
    """A ``FastIntersector`` whose primitives lie in ``blocks``."""

    blocks: LeafBlocks

    @property
    def solves_blocks(self) -> bool:
        """Whether the triangles of a block are solved at once."""
        return self.blocks.has_distances and self.is_plain_geometry

    @ti.func
    def search_leaf(self, reference, ray, bounds, aim, t_min, best, best_id, best_u, best_v, best_place):
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
                            best, best_id, best_u, best_v, best_place = t, primitive_id, v / total, w / total, place
            else:
                used = ti.min(first + count - (block << BLOCK_BITS), BLOCK)
                mask = self.blocks.candidates(ray, aim, block, used)
                while mask != 0:
                    place = (block << BLOCK_BITS) + first_lane(mask)
                    mask &= mask - 1
                    t, u, v, primitive_id = self.try_at(place, ray, bounds, aim, t_min)
                    if t_min < t and (t < best or (t == best and primitive_id < best_id)):
                        best, best_id, best_u, best_v, best_place = t, primitive_id, u, v, place
        return best, best_id, best_u, best_v, best_place

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
    def try_at(self, place, ray, bounds, aim, t_min):
        """(t, u, v, number) of the primitive at a place; t is −∞ for a miss."""
        primitive_id = self.blocks.primitive(place)
        v0, v1, v2 = self.blocks.triangle(place)
        t, u, v = self.try_primitive(ray, bounds, primitive_id, v0, v1, v2, t_min)
        return t, u, v, primitive_id

    @ti.func
    def blocks_in_leaf(self, reference, ray, bounds, aim, t_min, t_max):
        """Whether a leaf has a hit with t_min < t < t_max."""
        blocked = False
        first, count = leaf_range(reference)
        for block in range(first >> BLOCK_BITS, (first + count + BLOCK - 1) >> BLOCK_BITS):
            if ti.static(self.solves_blocks):
                u, v, w = self.blocks.edges(aim, block)
                may_hit = may_be_inside(u, v, w)
                if lanes_of(may_hit) != 0:
                    t = self.blocks.distances(ray, bounds, aim, block)
                    mask = lanes_of(may_hit & (t_min < t) & (t < t_max))
                    while mask != 0:
                        lane = first_lane(mask)
                        mask &= mask - 1
                        place = (block << BLOCK_BITS) + lane
                        found, _, _, _ = self.solved(ray, aim, place, u[lane], v[lane], w[lane], t[lane])
                        if found > -tm.inf:
                            blocked = True
                            mask = 0
            else:
                used = ti.min(first + count - (block << BLOCK_BITS), BLOCK)
                mask = self.blocks.candidates(ray, aim, block, used)
                while mask != 0:
                    place = (block << BLOCK_BITS) + first_lane(mask)
                    mask &= mask - 1
                    t, _, _, _ = self.try_at(place, ray, bounds, aim, t_min)
                    if t_min < t and t < t_max:
                        blocked = True
                        mask = 0
        return blocked

    @ti.func
    def leaf_box(self, i):
        """The box of the primitive at place i, see ``leaf_blocks``."""
        v0, v1, v2 = self.blocks.triangle(i)
        return smaller(v0, smaller(v1, v2)), larger(v0, larger(v1, v2))
