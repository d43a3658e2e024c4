"""Intersectors that search for t, id and barycentric coordinates, and make a HitData only of the nearest hit."""

import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.boxes import within_box
from taichi_tracer.formulas.triangles import stable_normal
from taichi_tracer.ray import no_hit
from taichi_tracer.ray_intersector import BruteForceRayIntersector, RayIntersector
from taichi_tracer.system.seams import seams


@ti.data_oriented
@seams()
class FastIntersector(RayIntersector):
    """A ``RayIntersector`` whose subclasses define ``nearest`` and ``is_blocked``.

    Attributes:
        stands_in_for: the plain class for which it stands in; both give the same answers, to the last bit.
        has_special_triangles: whether rays pass through the backs of some triangles, or through their holes.
        is_plain_geometry: whether there are only triangles, and none of these.
    """

    stands_in_for: type = RayIntersector

    def bind(self, geometry, triangle_test="watertight") -> None:
        """As in the base class."""
        super().bind(geometry, triangle_test)
        effects = geometry.effects
        self.has_special_triangles = effects.culling or effects.holes
        self.is_plain_geometry = not (effects.spheres or self.has_special_triangles)

    @ti.func
    def query_ray(self, ray):
        """HitData of the nearest hit in front of the origin."""
        return self.query_segment(ray, 0.0, tm.inf)

    @ti.func
    def query_segment(self, ray, t_min, t_max):
        """HitData of the nearest hit with t_min < t < t_max."""
        t, primitive_id, u, v = self.nearest(ray, t_min, t_max)
        hit = no_hit()
        if primitive_id >= 0:
            hit = self.describe(ray, t, primitive_id, u, v, t_min, t_max)
        return hit

    @ti.func
    def try_primitive(self, ray, bounds, primitive_id, v0, v1, v2, t_min):
        """(t, u, v) on the triangle with the given vertices, or on the sphere with this number; t is −∞ for a miss."""
        t, u, v = -tm.inf, 0.0, 0.0
        if ti.static(not self.geometry.effects.spheres):
            t, u, v = self.try_corners(ray, bounds, primitive_id, v0, v1, v2)
        else:
            index = self.geometry.primitives[primitive_id]
            if index < 0:
                t = self.sphere_candidate(ray, bounds, -1 - index, t_min)
            else:
                t, u, v = self.try_corners(ray, bounds, index, v0, v1, v2)
        return t, u, v

    @ti.func
    def try_corners(self, ray, bounds, triangle_id, v0, v1, v2):
        """(t, u, v) of the ray on one triangle; t is −∞ if the ray misses it, or comes from a back that it passes."""
        is_inside, distance, u, v, det = self.solve(ray.origin, ray.direction, v0, v1, v2)
        t = -tm.inf
        if is_inside and det != 0:
            t = within_box(bounds, distance, v0, v1, v2)
        if ti.static(self.geometry.effects.culling):
            if self.geometry.culls[triangle_id] != 0 and tm.dot(ray.direction, stable_normal(v0, v1, v2)) > 0:
                t = -tm.inf
        if ti.static(self.geometry.effects.holes):
            if t > -tm.inf:
                if self.geometry.textures.is_hole(self.geometry.triangle_material_ids[triangle_id], triangle_id, u, v):
                    t = -tm.inf
        return t, u, v

    @ti.func
    def is_special(self, primitive_id):
        """Whether a primitive is a sphere, or a triangle that rays may pass through."""
        special = False
        index = primitive_id
        if ti.static(self.geometry.effects.spheres):
            index = self.geometry.primitives[primitive_id]
            special = index < 0
        if ti.static(self.geometry.effects.culling):
            special = special or self.geometry.culls[ti.max(index, 0)] != 0
        if ti.static(self.geometry.effects.holes):
            material_id = self.geometry.triangle_material_ids[ti.max(index, 0)]
            special = special or self.geometry.textures.may_have_hole(material_id)
        return special

    @ti.func
    def is_sphere(self, primitive_id):
        """Whether a primitive is a sphere."""
        found = False
        if ti.static(self.geometry.effects.spheres):
            found = self.geometry.primitives[primitive_id] < 0
        return found

    @ti.func
    def sphere(self, primitive_id):
        """The centre and the radius of a primitive that is a sphere."""
        sphere = self.geometry.spheres[-1 - self.geometry.primitives[primitive_id]]
        return sphere.xyz, sphere.w

    @ti.func
    def describe(self, ray, t, primitive_id, u, v, t_min=0.0, t_max=tm.inf):
        """HitData from t, number and barycentric coordinates; the same as in the plain form."""
        outward = self.outward_of(ray, t, primitive_id)
        return self.describe_with(ray, t, primitive_id, u, v, outward, t_min, t_max)

    @ti.func
    def describe_with(self, ray, t, primitive_id, u, v, outward, t_min=0.0, t_max=tm.inf):
        """``describe`` with ``outward_of`` the hit."""
        hit = no_hit()
        if ti.static(not self.geometry.effects.spheres):
            hit = self.describe_corners(ray, t, primitive_id, u, v, self.geometry.triangle(primitive_id), t_min, t_max)
        else:
            index = self.geometry.primitives[primitive_id]
            if index >= 0:
                hit = self.describe_corners(ray, t, index, u, v, self.geometry.triangle(index), t_min, t_max)
            else:
                hit = self.describe_sphere(ray, t, -1 - index, outward)
            hit.triangle_id = primitive_id
        return hit

    @ti.func
    def describe_corners(self, ray, t, triangle_id, u, v, corners, t_min, t_max):
        """HitData of the triangle with these corners, with its exact t."""
        hit = self.describe_triangle(ray, t, triangle_id, u, v, corners)
        hit.distance = self.exact_distance(ray, t, corners, t_min, t_max)
        return hit

    @ti.func
    def outward_of(self, ray, t, primitive_id):
        """``outward_normal`` of a hit on a sphere; 0 if the ray met a triangle or nothing."""
        outward = tm.vec3(0)
        if ti.static(self.geometry.effects.spheres):
            if primitive_id >= 0:  # first: Taichi evaluates both sides of an "and"
                index = self.geometry.primitives[primitive_id]
                if index < 0:
                    outward = self.outward_normal(ray, t, -1 - index)
        return outward

    @ti.func
    def describe_met(self, ray, t, primitive_id, u, v, v0, v1, v2, t_min, t_max):
        """``describe`` for a search that has the vertices of the triangle at hand; of a sphere, they are not used."""
        hit = no_hit()
        if ti.static(not self.geometry.effects.spheres):
            hit = self.describe_corners(ray, t, primitive_id, u, v, (v0, v1, v2), t_min, t_max)
        else:
            hit = self.describe(ray, t, primitive_id, u, v, t_min, t_max)
        return hit


@ti.data_oriented
@seams()
class FastBruteForce(FastIntersector):
    """Tries every primitive, and makes a HitData only of the nearest hit."""

    name, form, stands_in_for = "brute_force", "every primitive, the nearest described once", BruteForceRayIntersector

    @ti.func
    def nearest(self, ray, t_min, t_max):
        """(t, id, u, v) of the nearest hit with t_min < t < t_max, lowest id if equal; else (t_max, −1, 0, 0)."""
        bounds = self.ray_bounds(ray)
        best, best_id, best_u, best_v = t_max, -1, 0.0, 0.0
        if self.is_legal(ray):
            for i in range(self.geometry.n_primitives):
                t, u, v = self.try_number(ray, bounds, i, t_min)
                if t_min < t and t < best:
                    best, best_id, best_u, best_v = t, i, u, v
        return best, best_id, best_u, best_v

    @ti.func
    def is_blocked(self, ray, t_min, t_max):
        """Whether anything is hit with t_min < t < t_max."""
        bounds = self.ray_bounds(ray)
        blocked = False
        if self.is_legal(ray):
            for i in range(self.geometry.n_primitives):
                t, u, v = self.try_number(ray, bounds, i, t_min)
                if t_min < t and t < t_max:
                    blocked = True
                    break
        return blocked

    @ti.func
    def try_number(self, ray, bounds, primitive_id, t_min):
        """``try_primitive`` of the primitive with this number."""
        index = primitive_id
        if ti.static(self.geometry.effects.spheres):
            index = ti.max(self.geometry.primitives[primitive_id], 0)
        v0, v1, v2 = self.geometry.triangle(index)
        return self.try_primitive(ray, bounds, primitive_id, v0, v1, v2, t_min)
