"""Objects that stand in several places, in trees whose nodes have eight children: the fast form of ``TwoLevelBVH``.

The nodes of all objects, and those of the upper tree, whose leaves are places, are in the same arrays. One loop goes
down both. When a ray comes to a place, ``UPWARDS`` waits on the stack below the nodes of the object: when it is taken
from the stack, the ray is in the world again.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast import bvh_build
from taichi_tracer.fast.bvh_wide import ABSENT, LEAF_BITS, WIDTH, WideTree, collapse, empty_tree
from taichi_tracer.fast.leaf_blocks import LeafBlocks, aim_of, leaf_range, primitives_at_once
from taichi_tracer.fast.wide_bvh import NOTHING, UNBRANCHED, WideBVH
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Geometry
from taichi_tracer.intersectors.instances import InPlaces, TwoLevelBVH, boxes_of_places, rows_of_objects
from taichi_tracer.places import Places
from taichi_tracer.ray import no_hit, real
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.seams import seams
from taichi_tracer.system.tables import Tables

UPWARDS = NOTHING + 1  # a reference to what is above the object
WORLD = -1  # in place of a place


@ti.dataclass
class AimInPlace:
    """An ``Aim``, see ``leaf_blocks``, and the place in which the ray is; or ``WORLD``."""

    x: ti.i32
    y: ti.i32
    z: ti.i32
    origin: tm.vec3
    shear_x: real
    shear_y: real
    place: ti.i32


@ti.data_oriented
class PlacedBlocks(LeafBlocks):
    """The blocks of objects, whose vertices a ray sees in the place to which it has come."""

    places: Places
    is_in_one_place = False

    @ti.func
    def along(self, aim, block, axis):
        """As in the base class: in world space, with the rounding of ``Places.to_world``."""
        row, wide = self.places.matrices[aim.place, axis], self.places.matrices.dtype
        x = ti.cast(self.vertices[block, 0], wide)
        y = ti.cast(self.vertices[block, 1], wide)
        z = ti.cast(self.vertices[block, 2], wide)
        return ti.cast(row[0] * x + row[1] * y + row[2] * z + row[3], float)


@ti.data_oriented
@seams()
class WideInstances(InPlaces, WideBVH):
    """Tries only triangles whose boxes the ray meets, in places whose boxes it meets."""

    name, form, stands_in_for = "bvh", "objects in several places, in hierarchies of eight boxes a node", TwoLevelBVH

    def bind(self, geometry: Geometry, triangle_test: str | TriangleTest = "watertight") -> None:
        """Build the trees over what a ray can hit."""
        super().bind(geometry, triangle_test)
        self.solve_packet = None  # the rays of a packet come to different places
        self._memory_of_places = memory.Memory()
        self.order, self.first = ti.field(ti.i32), ti.field(ti.i32)
        self._memory_of_places.fields.dense(ti.i, max(1, len(self.places_in_order))).place(self.order)
        self._memory_of_places.fields.dense(ti.i, len(self.roots) - 1).place(self.first)
        self._memory_of_places.allocate()
        tables = Tables()
        tables.put(self.order, np.append(self.places_in_order, 0).astype(np.int32)[: max(1, len(self.places_in_order))])
        tables.put(self.first, self.roots[1:].astype(np.int32))
        tables.load(self._memory_of_places)

    def destroy(self) -> None:
        """Free the trees' memory."""
        super().destroy()
        self._memory_of_places.free()

    def trees(self, geometry: Geometry) -> tuple[np.ndarray, np.ndarray, WideTree, np.ndarray]:
        """As in the base class: the nodes of the upper tree, then those of the objects; and references to all roots."""
        at_once = primitives_at_once(self.solve, geometry.effects.spheres)
        ids, boxes = geometry.hittable()
        of_objects = [(rows, *wide_tree(boxes[rows], at_once)) for rows in rows_of_objects(geometry, ids)]
        in_order = [rows[order] for rows, order, _ in of_objects]
        places, boxes = boxes_of_places(geometry.mesh.placed, [boxes[rows] for rows in in_order], runtime.dtype())
        order, upper = wide_tree(boxes, 1)
        self.places_in_order = places[order]
        planes, children, roots = [upper.planes], [upper.children], [0]
        if upper.root < 0 and len(places) > 0:  # a single leaf, which becomes the child of a node
            planes[0][0, :, 0] = np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
            planes[0][0, :, 1:] = np.array([np.inf] * 3 + [-np.inf] * 3)[:, None]
            children[0][0, 0] = upper.root
        self.upper_nodes = len(upper.children)
        entry, node = 0, self.upper_nodes
        for rows, _, tree in of_objects:
            roots.append(_shifted(np.array([tree.root]), entry, node)[0])
            planes.append(tree.planes)
            children.append(_shifted(tree.children, entry, node))
            entry, node = entry + len(rows), node + len(tree.children)
        depth = upper.depth + max(tree.depth for *_, tree in of_objects)
        waiting = upper.stack_size + 2 + max(tree.stack_size for *_, tree in of_objects)
        whole = WideTree(np.concatenate(planes), np.concatenate(children), 0, depth, waiting, upper.cost)
        return ids, np.concatenate(in_order), whole, np.array(roots)

    def in_blocks(self, references: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """As in the base class; the leaves of the upper tree have no blocks."""
        of_upper = np.arange(len(references)) < self.upper_nodes * WIDTH
        moved, places = super().in_blocks(np.where(of_upper, 0, references), count)
        return np.where(of_upper, references, moved).astype(np.int32), places

    def blocks_of(self, geometry: Geometry) -> LeafBlocks:
        """The memory of the leaves."""
        blocks = PlacedBlocks(self._memory.fields, self.num_places, self.solve, geometry.effects.spheres)
        blocks.places = geometry.places
        return blocks

    @ti.func
    def nearest_place(self, ray, t_min, t_max):
        """As in the base class; the id is that of a primitive in its place."""
        bounds = self.ray_bounds(ray)
        aim, boxes = self.aim_in_world(ray), bounds
        best, best_id, best_u, best_v, best_place = t_max, -1, 0.0, 0.0, 0
        waiting = ti.Vector([0] * self.stack_size, ti.i32)
        waiting_t = ti.Vector([0.0] * self.stack_size, float)
        top = 0
        reference = NOTHING
        if self.is_legal(ray):
            reference = self.root
        while reference != NOTHING:
            following = NOTHING
            if reference == UPWARDS:
                aim.place, boxes = WORLD, bounds
            elif reference >= 0:
                t_near, mask = self.met_children(boxes, reference, t_min, best)
                following, top = self.enter(waiting, waiting_t, top, reference, t_near, mask, UNBRANCHED)
            elif aim.place == WORLD:
                first, count = leaf_range(reference)
                if count > 0:
                    if count > 1:
                        waiting[top], waiting_t[top] = rest_of_leaf(first, count), t_min
                        top += 1
                    waiting[top], waiting_t[top] = UPWARDS, -tm.inf
                    top += 1
                    aim.place = self.order[first]
                    boxes = self.bounds_in(aim.place, ray)
                    following = self.first[self.geometry.places.objects[aim.place]]
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
        """Whether anything is hit with t_min < t < t_max."""
        bounds = self.ray_bounds(ray)
        aim, boxes = self.aim_in_world(ray), bounds
        blocked = False
        waiting = ti.Vector([0] * self.stack_size, ti.i32)
        top = 0
        reference = NOTHING
        if self.is_legal(ray):
            reference = self.root
        while reference != NOTHING:
            following, is_done = NOTHING, True
            if reference == UPWARDS:
                aim.place, boxes = WORLD, bounds
            elif reference >= 0:
                _, mask = self.met_children(boxes, reference, t_min, t_max)
                following, top = self.enter_any(waiting, top, reference, mask)
                is_done = False
            elif aim.place == WORLD:
                first, count = leaf_range(reference)
                if count > 0:
                    if count > 1:
                        waiting[top] = rest_of_leaf(first, count)
                        top += 1
                    waiting[top] = UPWARDS
                    top += 1
                    aim.place = self.order[first]
                    boxes = self.bounds_in(aim.place, ray)
                    following = self.first[self.geometry.places.objects[aim.place]]
                    is_done = False
            elif self.blocks_in_leaf(reference, ray, bounds, aim, t_min, t_max):
                blocked, is_done = True, False
            if is_done and top > 0:
                top -= 1
                following = waiting[top]
            reference = following
        return blocked

    @ti.func
    def aim_in_world(self, ray):
        """The ``AimInPlace`` of a ray that has come to no place."""
        a = aim_of(ray)
        return AimInPlace(x=a.x, y=a.y, z=a.z, origin=a.origin, shear_x=a.shear_x, shear_y=a.shear_y, place=WORLD)

    @ti.func
    def try_at(self, place, ray, bounds, aim, t_min):
        """As in the base class: ``place`` is one of ``leaf_blocks``, ``aim.place`` is where the object stands."""
        number = self.blocks.primitive(place)
        t, u, v = self.try_in(aim.place, number, ray, bounds, t_min)
        return t, u, v, self.geometry.places.id_of(aim.place, number)

    @ti.func
    def query_segment(self, ray, t_min, t_max):
        """HitData of the nearest hit with t_min < t < t_max."""
        t, primitive_id, u, v, _ = self.nearest_place(ray, t_min, t_max)
        hit = no_hit()
        if primitive_id >= 0:
            hit = self.describe(ray, t, primitive_id, u, v, t_min, t_max)
        return hit

    @ti.func
    def outward_of(self, ray, t, primitive_id):
        """Nothing: ``describe_in`` computes the normals of spheres."""
        return tm.vec3(0)

    @ti.func
    def describe_with(self, ray, t, primitive_id, u, v, outward, t_min=0.0, t_max=tm.inf):
        """As in the base class, of a primitive in its place."""
        place = self.geometry.places.place_of(primitive_id)
        number = primitive_id + self.geometry.places.shifts[place]
        return self.describe_in(place, number, ray, t, tm.vec2(u, v), t_min, t_max)


@ti.func
def rest_of_leaf(first, count):
    """The reference to a leaf without its first entry."""
    return -1 - (((first + 1) << LEAF_BITS) + count - 1)


def wide_tree(boxes: np.ndarray, at_once: int) -> tuple[np.ndarray, WideTree]:
    """The order of the boxes in the leaves, and the tree."""
    if len(boxes) == 0:
        return np.zeros(0, np.int32), empty_tree(runtime.dtype())
    tree = bvh_build.build(boxes, at_once)
    return tree.order, collapse(tree)


def _shifted(references: np.ndarray, entry: int, node: int) -> np.ndarray:
    """References whose nodes and entries of leaves have so many others before them; empty leaves stay what they are."""
    is_empty_leaf = references == ABSENT
    moved = np.where(references >= 0, references + node, references - (entry << LEAF_BITS))
    return np.where(is_empty_leaf, references, moved).astype(np.int32)
