"""Where the objects of a scene stand, for kernels: the fields of ``instances.Placed``.

A ray meets the triangles of an object in world space: their corners are transformed in f64 and rounded to f32 once, as
those of a copy are. Therefore a triangle in a place has the hits, the errors and the edges of its copy. The ray itself
is transformed only to find out which triangles it may meet, with boxes that are widened by the error of doing so.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.boxes import RayBounds
from taichi_tracer.formulas.spheres import widened
from taichi_tracer.instances import Placed
from taichi_tracer.system import runtime
from taichi_tracer.system.memory import Tables, varying


@ti.data_oriented
class Places:
    """The places of the objects of one scene.

    Attributes:
        count: the number of places.
        matrices: (n,) 3 × 4, from objects to places, in f64 where there is any. inverses: the way back.
        starts: (n,) the id of the first primitive of each place.
        shifts: (n,) what is added to the id of a primitive to get its number in memory.
        objects: (n,) the number of the object.
        facing: (n,) −1 if the transform mirrors the object, else 1.
    """

    def __init__(self, placed: Placed, fields: ti.FieldsBuilder, has_spheres: bool) -> None:
        self._placed = placed
        self.count = varying(len(placed.object_of))
        wide = ti.f64 if runtime.has_f64() else ti.f32
        self.matrices = ti.Vector.field(4, wide)
        # An ellipsoid is where the ray of the object meets a sphere; so its inverse is as exact as its matrix.
        self.inverses = ti.Vector.field(4, wide if has_spheres else float)
        self.starts, self.shifts, self.objects = ti.field(ti.i32), ti.field(ti.i32), ti.field(ti.i32)
        self.facing = ti.field(float)
        place = fields.dense(ti.i, self.count)
        place.place(self.starts, self.shifts, self.objects, self.facing)
        place.dense(ti.j, 3).place(self.matrices)
        place.dense(ti.j, 3).place(self.inverses)

    def put(self, tables: Tables) -> None:
        """Give ``tables`` the arrays of the fields."""
        placed, dtype = self._placed, runtime.dtype()
        wide = np.float64 if runtime.has_f64() else np.float32
        starts = placed.starts[:-1]
        tables.put(self.matrices, placed.matrices.astype(wide))
        tables.put(self.inverses, placed.inverses().astype(wide if self.inverses.dtype == ti.f64 else dtype))
        tables.put(self.starts, starts.astype(np.int32))
        tables.put(self.shifts, (placed.primitives[placed.object_of] - starts).astype(np.int32))
        tables.put(self.objects, placed.object_of.astype(np.int32))
        tables.put(self.facing, np.where(np.linalg.det(placed.matrices[:, :, :3]) < 0, -1, 1).astype(dtype))

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
