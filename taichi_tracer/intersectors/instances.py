"""Objects that stand in several places: a hierarchy of places above the hierarchies of the objects (RT-12).

A ray goes down the upper tree to the places that it may meet, and there down the tree of the object. The nodes of all
trees are in the same arrays.

A ray meets the triangles of an object in world space: their corners are transformed in f64 and rounded to f32 once, as
those of a copy are. Therefore a triangle in a place has the hits, the errors and the edges of its copy. The ray itself
is transformed only to find out which triangles it may meet, with boxes that are widened by the error of doing so.
"""

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.boxes import RayBounds
from taichi_tracer.formulas.spheres import longitude_latitude, sphere_normal, sphere_roots, widened
from taichi_tracer.formulas.triangles import TriangleTest, stable_normal, thinness, unit
from taichi_tracer.geometry import Geometry
from taichi_tracer.instances import Placed
from taichi_tracer.intersectors.bvh import BVHRayIntersector, nodes_of
from taichi_tracer.ray import no_hit
from taichi_tracer.ray_intersector import facing_hit
from taichi_tracer.system import runtime
from taichi_tracer.system.memory import Memory, varying
from taichi_tracer.system.parts import overridable

# ── where the objects stand ──


@ti.data_oriented
class Places:
    """The places of the objects of one scene.

    Attributes:
        count: the number of places.
        matrices: (n,) 3 × 4, from objects to places, in f64 where there is any. inverses: the way back.
        starts: (n,) the id of the first primitive of each place.
        shifts: (n,) what is added to the id of a primitive to get its number in memory.
        roots: (n,) the node at which the tree of the object begins, which the intersector writes.
        facing: (n,) −1 if the transform mirrors the object, else 1.
    """

    def __init__(self, placed: Placed, has_spheres: bool) -> None:
        self.count = varying(len(placed.object_of))
        wide = ti.f64 if runtime.can("f64") else ti.f32
        self.matrices = ti.Vector.field(4, wide)
        # An ellipsoid is where the ray of the object meets a sphere; so its inverse is as exact as its matrix.
        self.inverses = ti.Vector.field(4, wide if has_spheres else float)
        self.starts, self.shifts, self.roots = ti.field(ti.i32), ti.field(ti.i32), ti.field(ti.i32)
        self.facing = ti.field(float)
        self.memory = Memory()
        place = self.memory.fields.dense(ti.i, self.count)
        place.place(self.starts, self.shifts, self.roots, self.facing)
        place.dense(ti.j, 3).place(self.matrices)
        place.dense(ti.j, 3).place(self.inverses)
        self.memory.allocate()
        self.memory.write(self.matrices, placed.matrices)
        self.memory.write(self.inverses, placed.inverses())
        self.memory.write(self.starts, placed.starts[:-1])
        self.memory.write(self.shifts, placed.primitives[placed.object_of] - placed.starts[:-1])
        self.memory.write(self.facing, np.where(np.linalg.det(placed.matrices[:, :, :3]) < 0, -1, 1))

    @ti.func
    def place_of(self, primitive_id):
        """The place to which a primitive belongs: the last one that starts at its id or before."""
        first, last = 0, self.count - 1
        while first < last:
            middle = (first + last + 1) // 2
            if self.starts[middle] <= primitive_id:
                first = middle
            else:
                last = middle - 1
        return first

    @ti.func
    def number(self, primitive_id):
        """The number of a primitive in memory."""
        return primitive_id + self.shifts[self.place_of(primitive_id)]

    @ti.func
    def id_of(self, place, number):
        """The id that a primitive with this number in memory has in a place."""
        return number - self.shifts[place]

    @ti.func
    def to_world(self, place, point):
        """A point of the object in its place, rounded once."""
        world = tm.vec3(0)
        for i in ti.static(range(3)):
            row = self.matrices[place, i]
            world[i] = ti.cast(row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3], float)
        return world

    @ti.func
    def normal_to_world(self, place, normal):
        """The direction of a normal of the object in its place, by the inverse transpose; not of unit length."""
        world = 0 * self.inverses[place, 0]
        for i in ti.static(range(3)):
            world += self.inverses[place, i] * normal[i]
        return ti.cast(tm.vec3(world[0], world[1], world[2]), float)

    @ti.func
    def to_object(self, place, ray):
        """(origin, direction) of a ray as the object sees it, with the same t: the direction keeps no length."""
        o, d = widened(ray.origin), widened(ray.direction)
        origin, direction = 0 * o, 0 * d
        for i in ti.static(range(3)):
            row = self.inverses[place, i]
            origin[i] = row[0] * o[0] + row[1] * o[1] + row[2] * o[2] + row[3]
            direction[i] = row[0] * d[0] + row[1] * d[1] + row[2] * d[2]
        return origin, direction

    @ti.func
    def bounds(self, place, ray, reach, pad_factor):
        """A ray as the object sees it, prepared for the object's boxes.

        They are widened by the rounding of the transform, and of the corners in world space, as the object sees it.

        Args:
            reach: how far anything may be from the origin of the ray, along each axis of the world.
            pad_factor: the rounding error of what is computed of numbers, relative to their size.
        """
        size, pad = abs(ray.origin) + reach, tm.vec3(0)
        origin, reciprocal = tm.vec3(0), tm.vec3(0)
        for i in ti.static(range(3)):
            row = ti.cast(self.inverses[place, i], float)
            o = row[0] * ray.origin[0] + row[1] * ray.origin[1] + row[2] * ray.origin[2] + row[3]
            d = row[0] * ray.direction[0] + row[1] * ray.direction[1] + row[2] * ray.direction[2]
            extent = abs(row)
            pad[i] = pad_factor * (extent[0] * size[0] + extent[1] * size[1] + extent[2] * size[2] + extent[3])
            origin[i], reciprocal[i] = o, 1 / d
        towards = ti.select(reciprocal >= 0, pad, -pad)
        return RayBounds(inverse=reciprocal, near_origin=origin + towards, far_origin=origin - towards)


# ── the search ──


MOST_PARTS = 64  # of an object whose boxes are transformed to find the box of a place: more parts make it tighter
FEW_CORNERS = 1_000_000  # that are transformed at once


@ti.data_oriented
@overridable()
class TwoLevelBVH(BVHRayIntersector):
    """Tries only primitives of places whose boxes the ray meets. It takes the place of ``BVHRayIntersector``.

    The leaves of the upper tree have places in ``order``, and those of the objects' trees have numbers of primitives.
    """

    name = "bvh"

    def bind(self, geometry: Geometry, triangle_test: str | TriangleTest = "watertight") -> None:
        """Build the trees over what a ray can hit."""
        super().bind(geometry, triangle_test)
        geometry.places.memory.write(geometry.places.roots, np.array(self.first_nodes)[geometry.mesh.placed.object_of])

    def trees(self, geometry: Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
        """The nodes of the upper tree, then those of the objects; what is in the leaves; how much waits on a stack."""
        ids, boxes = geometry.hittable()
        of_objects = [(rows, *nodes_of(boxes[rows])) for rows in rows_of_objects(geometry, ids)]
        ordered = [boxes[rows[order]] for rows, _, _, order, _ in of_objects]
        places, boxes = boxes_of_places(geometry.mesh.placed, ordered, runtime.dtype())
        box, links, order, depth = nodes_of(boxes)
        depth += int(links[:, 1].max())  # the places of a leaf wait together
        found, depths = [(box, links, places[order])], []
        self.first_nodes, first, node = [], len(order), len(box)
        for rows, own_box, own_links, own_order, own_depth in of_objects:
            self.first_nodes.append(node)
            own_links[:, 0] += np.where(own_links[:, 1] > 0, first, node).astype(np.int32)
            found.append((own_box, own_links, ids[rows[own_order]]))
            depths.append(own_depth)
            node, first = node + len(own_box), first + len(own_order)
        box, links, order = (np.concatenate(some) for some in zip(*found, strict=True))
        return box, links, order.astype(np.int32), depth + max(depths)

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        """As in the base class; the primitives are those of all places.

        A node waits on the stack together with the place in which its object is seen; −1 is the upper tree.
        """
        best, best_id, at, number, uv = t_max, -1, -1, -1, tm.vec2(0)
        bounds, place = self.ray_bounds(ray), -1
        seen = bounds  # the ray, as the object in ``place`` sees it
        stack, places = ti.Vector([0] * self.stack_size, ti.i32), ti.Vector([-1] * self.stack_size, ti.i32)
        waiting = ti.cast(self.is_legal(ray), ti.i32)
        while waiting > 0:
            waiting -= 1
            node = stack[waiting]
            if places[waiting] != place:
                place, seen = places[waiting], bounds
                if place >= 0:
                    seen = self.bounds_in(place, ray)
            t_near, t_far = self.node_interval(seen, node, t_min, best)
            if t_near <= t_far:
                if self.count[node] == 0:
                    stack[waiting], stack[waiting + 1] = self.first[node] + 1, self.first[node]
                    places[waiting], places[waiting + 1] = place, place
                    waiting += 2
                for i in range(self.first[node], self.first[node] + self.count[node]):
                    if place < 0:
                        places[waiting] = self.order[i]
                        stack[waiting] = self.geometry.places.roots[self.order[i]]
                        waiting += 1
                    else:
                        primitive_id = self.geometry.places.id_of(place, self.order[i])
                        t, u, v = self.try_in(place, self.order[i], primitive_id, ray, bounds, t_min)
                        if t_min < t and (t < best or (t == best and primitive_id < best_id)):
                            best, best_id, at, number, uv = t, primitive_id, place, self.order[i], tm.vec2(u, v)
                if ti.static(any_hit):
                    if best_id >= 0:
                        waiting = 0
        hit = no_hit()
        if best_id >= 0:
            hit = self.describe_in(at, number, ray, best, uv, t_min, t_max)
            hit.distance = best
        return hit

    @ti.func
    def with_exact_distance(self, ray, hit, t_min, t_max):
        """As in the base class: with the t that is computed again, as exactly as possible."""
        if hit.is_hit:
            place = self.geometry.places.place_of(hit.triangle_id)
            number = self.geometry.places.number(hit.triangle_id)
            hit = self.describe_in(place, number, ray, hit.distance, hit.barycentric_coords, t_min, t_max)
        return hit

    # ── what a primitive is in its place ──

    @ti.func
    def bounds_in(self, place, ray):
        """A ray as the object in a place sees it, prepared for the boxes of the object."""
        o, corners = ray.origin, self.geometry.corners
        reach = ti.max(abs(tm.vec3(corners[0]) - o), abs(tm.vec3(corners[1]) - o))
        return self.geometry.places.bounds(place, ray, reach, self.pad_factor)

    @ti.func
    def triangle_in(self, place, triangle_id):
        """The three corners of a triangle in a place."""
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        places = self.geometry.places
        return places.to_world(place, v0), places.to_world(place, v1), places.to_world(place, v2)

    @ti.func
    def try_in(self, place, number, primitive_id, ray, bounds, t_min):
        """(t, u, v) on a primitive in a place; t is −∞ for a miss.

        Args:
            number: of the primitive in memory. primitive_id: its id there. bounds: ``ray_bounds`` of the ray.
        """
        t, u, v = -tm.inf, 0.0, 0.0
        index = number
        if ti.static(self.geometry.effects.spheres):
            index = self.geometry.primitives[number]
            if index < 0:
                t = self.ellipsoid_in(place, -1 - index, ray, t_min)
        if index >= 0:
            corners, facing = self.triangle_in(place, index), self.geometry.places.facing[place]
            t, u, v = self.try_corners(ray, bounds, primitive_id, index, corners, facing)
        return t, u, v

    @ti.func
    def ellipsoid_in(self, place, sphere_id, ray, t_min):
        """t where a ray enters a sphere in its place, or leaves it, if the entry is not beyond t_min."""
        sphere = self.geometry.spheres[sphere_id]
        o, d = self.geometry.places.to_object(place, ray)
        t = -tm.inf
        is_met, t_in, t_out = sphere_roots(o, d, widened(sphere.xyz), widened(sphere.w))
        if is_met and sphere.w > 0:
            t = ti.cast(ti.select(ti.cast(t_in, float) > t_min, t_in, t_out), float)
        return t

    @ti.func
    def describe_in(self, place, number, ray, t, uv, t_min, t_max):
        """HitData of a primitive in a place, from t and the barycentric coordinates (u, v)."""
        hit, index = no_hit(), number
        if ti.static(self.geometry.effects.spheres):
            index = self.geometry.primitives[number]
            if index < 0:
                hit = self.describe_ellipsoid(place, -1 - index, ray, t)
        if index >= 0:
            hit = self.describe_triangle_in(place, index, ray, t, uv)
            hit.distance = self.exact_distance(ray, t, self.triangle_in(place, index), t_min, t_max)
        hit.triangle_id = self.geometry.places.id_of(place, number)
        return hit

    @ti.func
    def describe_triangle_in(self, place, triangle_id, ray, t, uv):
        """As ``describe_triangle``, of a triangle in a place. A mirrored front stays a front."""
        places = self.geometry.places
        v0, v1, v2 = self.triangle_in(place, triangle_id)
        geometric_normal = places.facing[place] * unit(stable_normal(v0, v1, v2))
        normal = geometric_normal
        if ti.static(self.geometry.effects.interpolated_normals):
            own = places.normal_to_world(place, self.geometry.shading_normal(triangle_id, uv.x, uv.y, tm.vec3(0)))
            if tm.component_max(abs(own)) > 0:
                normal = unit(own)
        position, position_error = self.geometry.position(uv.x, uv.y, v0, v1, v2, thinness(v0, v1, v2))
        material_id = self.geometry.triangle_material_ids[triangle_id]
        return facing_hit(ray, t, uv, normal, geometric_normal, material_id, position, position_error)

    @ti.func
    def describe_ellipsoid(self, place, sphere_id, ray, t):
        """As ``describe_sphere``, of a sphere in a place; its (u, v) are those of the sphere."""
        places, sphere = self.geometry.places, self.geometry.spheres[sphere_id]
        o, d = places.to_object(place, ray)
        outward = sphere_normal(o, d, widened(sphere.xyz), widened(sphere.w), t)
        point = sphere.xyz + sphere.w * outward
        position, size, extent = places.to_world(place, point), tm.vec3(0), abs(sphere.xyz) + sphere.w
        for i in ti.static(range(3)):
            row = ti.cast(abs(places.matrices[place, i]), float)
            size[i] = tm.dot(row.xyz, extent) + row.w
        n, error = unit(places.normal_to_world(place, outward)), size * ti.static(8 * runtime.epsilon())
        material_id = self.geometry.sphere_material_ids[sphere_id]
        return facing_hit(ray, t, longitude_latitude(outward), n, n, material_id, position, error)


def rows_of_objects(geometry: Geometry, ids: np.ndarray) -> list[np.ndarray]:
    """For each object, which of the primitives with these numbers are its own."""
    owner = np.searchsorted(geometry.mesh.placed.primitives, ids, "right") - 1
    rows = np.argsort(owner, kind="stable")
    return np.split(rows, np.searchsorted(owner[rows], np.arange(1, len(geometry.mesh.placed.primitives) - 1)))


def boxes_of_places(placed: Placed, boxes: list[np.ndarray], dtype: type[np.floating]) -> tuple[np.ndarray, np.ndarray]:
    """(m,) the places that have anything to be hit, and the (m, 6) boxes of what is there.

    Args:
        boxes: for each object, the boxes of its primitives, neighbours near each other. They are put into a few
            parts. The box of a place is around the boxes of these parts, which are transformed.
    """
    found = np.full((len(placed.object_of), 6), np.nan)
    for number, own in enumerate(boxes):
        places = np.flatnonzero(placed.object_of == number)
        if len(own) == 0 or len(places) == 0:
            continue
        parts = int(np.clip(FEW_CORNERS // (8 * len(places)), 1, MOST_PARTS))
        starts = np.unique(np.linspace(0, len(own), parts, endpoint=False).astype(int))
        low, high = np.minimum.reduceat(own[:, :3], starts), np.maximum.reduceat(own[:, 3:], starts)
        corners = np.where(np.array(list(np.ndindex(2, 2, 2)), bool)[:, None], high, low).reshape(-1, 3)
        for some in np.array_split(places, -(-len(places) * len(corners) // FEW_CORNERS)):
            matrix = placed.matrices[some]
            points = corners.astype(np.float64) @ matrix[:, :, :3].transpose(0, 2, 1) + matrix[:, None, :, 3]
            found[some] = np.concatenate([points.min(axis=1), points.max(axis=1)], axis=1)
    is_there = ~np.isnan(found[:, 0])
    return np.flatnonzero(is_there), found[is_there].astype(dtype)
