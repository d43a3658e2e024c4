"""What does the ray meet? Two triangle tests as their papers have them, and the nearest hit by trying every triangle.

A triangle test is a formula: it solves, and says whether the ray passes inside the edges. Whether that is a hit is
decided in one place, ``RayIntersector.candidate``, for every test and every accelerator.
"""

from abc import ABC, abstractmethod

import taichi as ti
import taichi.math as tm

from taichi_tracer.formulas.spheres import longitude_latitude, sphere_normal, sphere_roots, widened
from taichi_tracer.geometry import Geometry, stable_normal
from taichi_tracer.ray import HitData, no_hit
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import one_of


@ti.func
def moller_trumbore(o, d, v0, v1, v2):
    """Solve  o + t d = (1 − u − v) v0 + u v1 + v v2  by Cramer's rule (Möller & Trumbore 1997; A1-11).

    Returns (is_inside, t, u, v, det). det > 0 when the triangle faces the ray; 0 when the two are parallel: then t, u
    and v are not finite. No ε: det scales with size²·|d|, so a fixed one would delete small triangles (C-8).
    """
    e1 = v1 - v0
    e2 = v2 - v0
    s = o - v0

    det = tm.dot(e1, tm.cross(d, e2))
    u = tm.dot(s, tm.cross(d, e2)) / det
    v = tm.dot(d, tm.cross(s, e1)) / det
    t = tm.dot(e2, tm.cross(s, e1)) / det

    is_inside = u >= 0 and v >= 0 and u + v <= 1
    return is_inside, t, u, v, det


@ti.func
def watertight(o, d, v0, v1, v2):
    """On which side of each projected edge does the ray pass? (Woop, Benthin & Wald, JCGT 2(1), 2013)

    Returns (is_inside, t, u, v, det) as ``moller_trumbore`` does. Two triangles that share an edge compute the same
    number for it, up to its sign, so no ray slips between them.

    Deviations from the paper: t comes from the triangle's plane, since the interpolated one errs in proportion to the
    triangle's size; the projection is two dot products instead of a permutation of the axes, with the same rounding.
    """
    x_axis, y_axis = shear_axes(d)
    a = v0 - o
    b = v1 - o
    c = v2 - o
    ax, ay = tm.dot(x_axis, a), tm.dot(y_axis, a)
    bx, by = tm.dot(x_axis, b), tm.dot(y_axis, b)
    cx, cy = tm.dot(x_axis, c), tm.dot(y_axis, c)

    u_edge = cx * by - cy * bx
    v_edge = ax * cy - ay * cx
    w_edge = bx * ay - by * ax
    if ti.static(runtime.can_widen()):
        if u_edge == 0 or v_edge == 0 or w_edge == 0:  # products of f32 are exact in f64: these signs are right
            u_edge = exact_difference(cx, by, cy, bx)
            v_edge = exact_difference(ax, cy, ay, cx)
            w_edge = exact_difference(bx, ay, by, ax)
    any_negative = u_edge < 0 or v_edge < 0 or w_edge < 0
    any_positive = u_edge > 0 or v_edge > 0 or w_edge > 0
    total = u_edge + v_edge + w_edge
    is_inside = total != 0 and not (any_negative and any_positive)

    n = stable_normal(v0, v1, v2)
    det = -tm.dot(d, n)
    t = -tm.dot(a, n) / det
    return is_inside, t, v_edge / total, w_edge / total, det


@ti.func
def shear_axes(d):
    """Two axes x, y with x·d = y·d = 0, whose dot products project along d onto the plane of d's two smaller axes."""
    is_x = abs(d.x) > abs(d.y) and abs(d.x) > abs(d.z)
    is_y = abs(d.y) > abs(d.z)
    largest = ti.select(is_x, d.x, ti.select(is_y, d.y, d.z))
    x, y, z = -d.x / largest, -d.y / largest, -d.z / largest
    x_axis = ti.select(is_x, tm.vec3(y, 1, 0), ti.select(is_y, tm.vec3(0, z, 1), tm.vec3(1, 0, x)))
    y_axis = ti.select(is_x, tm.vec3(z, 0, 1), ti.select(is_y, tm.vec3(1, x, 0), tm.vec3(0, 1, y)))
    return x_axis, y_axis


@ti.func
def exact_difference(p, q, r, s):
    """p q − r s of f32 numbers with the right sign: computed in f64, where the products are exact.

    A result too small for f32 keeps its sign as the smallest normal number.
    """
    exact = ti.cast(p, ti.f64) * ti.cast(q, ti.f64) - ti.cast(r, ti.f64) * ti.cast(s, ti.f64)
    rounded = ti.cast(exact, ti.f32)
    smallest_f32 = 1.1754944e-38
    if rounded == 0 and exact != 0:
        rounded = ti.select(exact > 0, smallest_f32, -smallest_f32)
    return rounded


@ti.func
def plane_distance(o, d, v0, v1, v2):
    """t where the ray meets the triangle's plane, computed in f64: the nearest f32, also for an origin close to it."""
    a = ti.cast(v0, ti.f64) - ti.cast(o, ti.f64)
    n = tm.cross(ti.cast(v1, ti.f64) - ti.cast(v0, ti.f64), ti.cast(v2, ti.f64) - ti.cast(v0, ti.f64))
    return ti.cast(tm.dot(a, n) / tm.dot(ti.cast(d, ti.f64), n), ti.f32)


TRIANGLE_TESTS = {"watertight": watertight, "moller_trumbore": moller_trumbore}


@ti.dataclass
class RayBounds:
    """A ray prepared for boxes: reciprocal direction, and the origin moved towards and away from where it goes.

    Moving it by ``pad`` both ways widens every box by the rounding error of a triangle test on this ray, so that no box
    is missed whose triangle is hit.
    """

    inverse: tm.vec3
    near_origin: tm.vec3
    far_origin: tm.vec3


@ti.func
def box_interval(bounds, low, high, t_near, t_far):
    """The part of [t_near, t_far] in which the ray is in the box, empty when the first exceeds the second.

    Slabs by the sign of 1/d, not of d, because of −0; a NaN (0 · ∞, a ray in the plane of a face) changes nothing.
    Each operation is monotonic: a box within another has an interval within the other's, to the last bit.
    """
    for k in ti.static(range(3)):
        is_forward = bounds.inverse[k] >= 0
        near = (ti.select(is_forward, low[k], high[k]) - bounds.near_origin[k]) * bounds.inverse[k]
        far = (ti.select(is_forward, high[k], low[k]) - bounds.far_origin[k]) * bounds.inverse[k]
        t_near = ti.select(near > t_near, near, t_near)
        t_far = ti.select(far < t_far, far, t_far)
    return t_near, t_far


@ti.data_oriented
class RayIntersector(ABC):
    """Finds what a ray meets in a geometry. A subclass says in which order primitives are tried.

    Args:
        geometry: the triangles and spheres.
        triangle_test: a name in ``TRIANGLE_TESTS``.
    """

    def __init__(self, geometry: Geometry, triangle_test: str = "watertight") -> None:
        if triangle_test not in TRIANGLE_TESTS:
            raise one_of("triangle test", triangle_test, TRIANGLE_TESTS)
        self.geometry = geometry
        self.triangle_test = triangle_test
        self.solve = TRIANGLE_TESTS[triangle_test]
        # A triangle test computes with vertex − origin, so its rounding error is a few ε of the largest such number.
        self.pad_factor = 8 * runtime.epsilon()

    @abstractmethod
    def nearest(self, ray, t_min, t_max):
        """(t, id, u, v) of the nearest hit with t_min < t < t_max, of equals the lowest id; else (t_max, −1, 0, 0).

        On a sphere u and v are 0: ``describe`` knows better ones.
        """

    @abstractmethod
    def is_blocked(self, ray, t_min, t_max):
        """Whether anything is hit with t_min < t < t_max."""

    def destroy(self) -> None:  # noqa: B027 (most have nothing to free)
        """Free what the intersector allocated beside the geometry: nothing, unless a subclass does."""

    @ti.func
    def ray_bounds(self, ray):
        """``ray`` prepared for ``box_interval``."""
        o, d = ray.origin, ray.direction
        reach = ti.max(abs(tm.vec3(self.geometry.low) - o), abs(tm.vec3(self.geometry.high) - o)).max()
        pad = self.pad_factor * (reach + abs(o) / 4)  # the second part outweighs the rounding of o ± pad
        inverse = 1 / d
        towards = ti.select(inverse >= 0, pad, -pad)
        return RayBounds(inverse=inverse, near_origin=o + towards, far_origin=o - towards)

    @ti.func
    def candidate(self, ray, bounds, v0, v1, v2):
        """(t, u, v) of the ray on one triangle; t is −∞ when it misses.

        t is kept within the triangle's own box: where the plane is almost parallel to the ray the quotient is noise.
        The same boxes, by the same arithmetic, guide the accelerators, which therefore never skip a hit.
        """
        is_inside, t, u, v, det = self.solve(ray.origin, ray.direction, v0, v1, v2)
        distance = -tm.inf
        if is_inside and det != 0:
            low, high = ti.min(v0, v1, v2), ti.max(v0, v1, v2)
            t_near, t_far = box_interval(bounds, low, high, -tm.inf, tm.inf)
            if t_near <= t_far:
                distance = ti.select(t < t_near, t_near, ti.select(t > t_far, t_far, t))
        return distance, u, v

    @ti.func
    def candidate_of(self, ray, bounds, triangle_id, v0, v1, v2, t_min):
        """``candidate`` of the primitive with this id, in a scene that has more than triangles with two sides."""
        t, u, v = -tm.inf, 0.0, 0.0
        sphere = -1
        if ti.static(self.geometry.has_spheres):
            sphere = self.geometry.sphere_of[triangle_id]
            if sphere >= 0:
                t = self.sphere_candidate(ray, bounds, sphere, t_min)
        if sphere < 0:
            t, u, v = self.candidate(ray, bounds, v0, v1, v2)
            if ti.static(self.geometry.has_culling):
                if self.geometry.culls[triangle_id] != 0 and tm.dot(ray.direction, stable_normal(v0, v1, v2)) > 0:
                    t = -tm.inf
        return t, u, v

    @ti.func
    def sphere_candidate(self, ray, bounds, sphere, t_min):
        """t where the ray enters a sphere, or leaves it when the entry is not beyond t_min; −∞ when it misses.

        t is kept within the sphere's own box, for the reason that ``candidate`` gives.
        """
        centre, radius = self.geometry.spheres[sphere].xyz, self.geometry.spheres[sphere].w
        t = -tm.inf
        t_near, t_far = box_interval(bounds, centre - radius, centre + radius, -tm.inf, tm.inf)
        if t_near <= t_far:
            o, d = widened(ray.origin), widened(ray.direction)
            is_met, t_in, t_out = sphere_roots(o, d, widened(centre), widened(radius))
            if is_met:
                entry, exit = ti.cast(t_in, float), ti.cast(t_out, float)
                entry = ti.select(entry < t_near, t_near, entry)
                t = ti.select(entry > t_min, entry, ti.select(exit > t_far, t_far, exit))
        return t

    @ti.func
    def is_legal(self, ray):
        """Whether the ray has a direction and all its numbers are finite; any other misses everything."""
        total = abs(ray.origin).sum() + abs(ray.direction).sum()
        return total < tm.inf and abs(ray.direction).sum() > 0

    @ti.func
    def try_primitive(self, ray, bounds, triangle_id, t_min):
        """``candidate`` of the primitive with this id, by the shortest way that the scene allows."""
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        t, u, v = -tm.inf, 0.0, 0.0
        if ti.static(self.geometry.is_plain):
            t, u, v = self.candidate(ray, bounds, v0, v1, v2)
        else:
            t, u, v = self.candidate_of(ray, bounds, triangle_id, v0, v1, v2, t_min)
        return t, u, v

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        """HitData of one triangle, or of the sphere with this id, whatever lies before it (A1-14); t > 0."""
        t, u, v = self.try_primitive(ray, self.ray_bounds(ray), triangle_id, 0.0)
        data = no_hit()
        if self.is_legal(ray) and t > 0:
            data = self.describe(ray, t, triangle_id, u, v)
        return data

    @ti.func
    def query_ray(self, ray):
        """HitData of the nearest hit in front of the origin (A1-14)."""
        return self.query_segment(ray, 0.0, tm.inf)

    @ti.func
    def query_segment(self, ray, t_min, t_max):
        """HitData of the nearest hit with t_min < t < t_max."""
        t, triangle_id, u, v = self.nearest(ray, t_min, t_max)
        data = no_hit()
        if triangle_id >= 0:
            data = self.describe(ray, t, triangle_id, u, v, t_min, t_max)
        return data

    @ti.func
    def is_occluded(self, ray, t_max):
        """Whether anything lies on the ray before t_max."""
        return self.is_blocked(ray, 0.0, t_max)

    @ti.func
    def describe(self, ray, t, triangle_id, u, v, t_min=0.0, t_max=tm.inf):
        """HitData from t, id and barycentrics; both normals face the origin of the ray (A1-13, C-17).

        Once per hit there is time to compute t again, as exactly as it can be said; but a hit that was accepted between
        t_min and t_max stays there, or a march from hit to hit would find the same one for ever.
        """
        data = no_hit()
        if ti.static(self.geometry.has_spheres):
            sphere = self.geometry.sphere_of[triangle_id]
            if sphere >= 0:
                data = self.describe_sphere(ray, t, triangle_id, sphere)
            else:
                data = self.describe_triangle(ray, t, triangle_id, u, v, t_min, t_max)
        else:
            data = self.describe_triangle(ray, t, triangle_id, u, v, t_min, t_max)
        return data

    @ti.func
    def describe_sphere(self, ray, t, triangle_id, sphere):
        """``describe`` of a sphere; its (u, v) are longitude and latitude, from 0 to 1."""
        centre, radius = self.geometry.spheres[sphere].xyz, self.geometry.spheres[sphere].w
        o, d, c, r = widened(ray.origin), widened(ray.direction), widened(centre), widened(radius)
        is_met, t_in, t_out = sphere_roots(o, d, c, r)
        outward = sphere_normal(o, d, c, r, t_in, t_out, t)
        is_backfacing = tm.dot(ray.direction, outward) > 0
        normal = ti.select(is_backfacing, -outward, outward)
        return HitData(
            is_hit=1,
            is_backfacing=is_backfacing,
            triangle_id=triangle_id,
            distance=t,
            barycentric_coords=longitude_latitude(outward),
            normal=normal,
            geometric_normal=normal,
            material_id=self.geometry.face_materials[triangle_id],
        )

    @ti.func
    def describe_triangle(self, ray, t, triangle_id, u, v, t_min, t_max):
        """``describe`` of a triangle."""
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        distance = t
        if ti.static(runtime.can_widen()):
            low, high = ti.min(v0, v1, v2), ti.max(v0, v1, v2)
            t_near, t_far = box_interval(self.ray_bounds(ray), low, high, -tm.inf, tm.inf)
            exact = plane_distance(ray.origin, ray.direction, v0, v1, v2)
            if t_near <= exact and exact <= t_far and t_min < exact and exact < t_max:
                distance = exact
        geometric_normal = self.geometry.unit_normals[triangle_id]
        normal = self.geometry.shading_normal(triangle_id, u, v, geometric_normal)
        is_backfacing = tm.dot(ray.direction, geometric_normal) > 0
        facing = ti.select(is_backfacing, -1, 1)
        return HitData(
            is_hit=1,
            is_backfacing=is_backfacing,
            triangle_id=triangle_id,
            distance=distance,
            barycentric_coords=tm.vec2(u, v),
            normal=facing * normal,
            geometric_normal=facing * geometric_normal,
            material_id=self.geometry.face_materials[triangle_id],
        )


@ti.data_oriented
class BruteForceRayIntersector(RayIntersector):
    """Tries every triangle: the reference that every accelerator must equal, and what a student writes first."""

    name = "brute_force"

    @ti.func
    def nearest(self, ray, t_min, t_max):
        bounds = self.ray_bounds(ray)
        best, best_id, best_u, best_v = t_max, -1, 0.0, 0.0
        if self.is_legal(ray):
            for i in range(self.geometry.num_primitives):
                t, u, v = self.try_primitive(ray, bounds, i, t_min)
                if t_min < t and t < best:
                    best, best_id, best_u, best_v = t, i, u, v
        return best, best_id, best_u, best_v

    @ti.func
    def is_blocked(self, ray, t_min, t_max):
        bounds = self.ray_bounds(ray)
        blocked = False
        if self.is_legal(ray):
            for i in range(self.geometry.num_primitives):
                t, u, v = self.try_primitive(ray, bounds, i, t_min)
                if t_min < t and t < t_max:
                    blocked = True
                    break
        return blocked
