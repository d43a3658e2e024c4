"""What does the ray hit? A test of one triangle, and a search for the nearest hit that tries every triangle.

A student reads and replaces this file. ``intersect_triangle`` decides what a hit is, and
``query_ray`` finds the nearest hit. All other methods follow from these two. If you replace one of the two, you change
every picture and every answer of the scene. A hierarchy (``intersectors``) overrides only ``search``: it decides in
which order the primitives are tried, and which primitives need not be tried at all.
"""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.boxes import RayBounds, box_interval, triangle_interval, within_box
from taichi_tracer.formulas.spheres import longitude_latitude, sphere_normal, sphere_roots, widened
from taichi_tracer.formulas.triangles import TriangleTest, plane_distance, stable_normal
from taichi_tracer.geometry import Geometry
from taichi_tracer.ray import HitData, Ray, no_hit
from taichi_tracer.system import runtime
from taichi_tracer.system.parts import PARTS, overridable, register, replaced


@ti.data_oriented
@overridable(
    *("search", "query_segment", "is_blocked"),
    intersect_triangle="HitData",
    query_ray="HitData",
    is_occluded="truth",
)
class RayIntersector:
    """Finds what a ray hits in a geometry.

    Args:
        geometry: the triangles and spheres. With None, the intersector has no geometry yet, and the scene that gets the
            intersector calls ``bind``.
        triangle_test: a name in the registry, or a ``TriangleTest``.

    Attributes:
        EPSILON: the handout's fixed tolerance for the determinant and for t. The package's own tests do not use it,
            because a fixed ε misses small triangles and is too small for large triangles (C-8).
    """

    kind = "intersector"
    name = ""
    geometry: Geometry  # None before ``bind``
    EPSILON = 1e-7

    def __init__(self, geometry: Geometry | None = None, triangle_test: str | TriangleTest = "watertight") -> None:
        self.geometry = None  # type: ignore[assignment]  # so that typed code of a bound intersector need not ask
        if geometry is not None:
            self.bind(geometry, triangle_test)

    def bind(self, geometry: Geometry, triangle_test: str | TriangleTest = "watertight") -> None:
        """Make this the intersector of a geometry. A subclass that builds a grid or a hierarchy extends this method."""
        test = PARTS.find("triangle test", triangle_test)
        self.geometry, self.triangle_test, self.solve = geometry, test.name, test.solve
        # A triangle test computes with the difference vertex − origin. Its rounding error is a few ε times the largest
        # component of such a difference.
        self.pad_factor = 8 * runtime.epsilon()
        self.replaced = replaced(self)

    def facts(self) -> dict[str, str]:
        """Name → text: what ``taichi-tracer info`` prints about this intersector, in addition to its name."""
        return {}

    def destroy(self) -> None:
        """Free the memory that the intersector itself allocated. Only subclasses allocate some."""

    # ── what a student writes ──

    @ti.func
    def intersect_triangle(self, ray, triangle_id):
        """HitData of the ray on one triangle, with t > 0. Other triangles are not considered (A1-14)."""
        return self.triangle_hit(ray, triangle_id, 0.0)

    @ti.func
    def query_ray(self, ray):
        """HitData of the nearest hit in front of the origin (A1-14)."""
        return self.with_exact_distance(ray, self.search(ray, 0.0, tm.inf, False), 0.0, tm.inf)

    @ti.func
    def is_occluded(self, ray, t_max):
        """Whether anything lies on the ray before t_max."""
        return self.is_blocked(ray, 0.0, t_max)

    # ── what follows from it ──

    @ti.func
    def search(self, ray, t_min, t_max, any_hit: ti.template()):
        """HitData of the nearest hit with t_min < t < t_max; of any such hit, if ``any_hit`` is True.

        If several hits have the same t, the lowest id counts. This form tries every primitive.
        """
        best, best_id, best_u, best_v = t_max, -1, 0.0, 0.0
        bounds = self.ray_bounds(ray)
        for primitive_id in range(ti.select(self.is_legal(ray), self.geometry.n_primitives, 0)):
            t, u, v = self.try_primitive(ray, bounds, primitive_id, t_min)
            if t_min < t and t < best:
                best, best_id, best_u, best_v = t, primitive_id, u, v
                if ti.static(any_hit):
                    break
        return self.found(ray, best, best_id, best_u, best_v, any_hit)

    @ti.func
    def query_segment(self, ray, t_min, t_max):
        """HitData of the nearest hit with t_min < t < t_max.

        A replaced ``query_ray`` has no argument t_min. Therefore it gets a ray that starts at the point r(t_min).
        """
        if ti.static("query_ray" in self.replaced):
            hit = self.query_ray(Ray(origin=ray.at(t_min), direction=ray.direction))
            hit.distance += t_min
            if not (hit.is_hit and hit.distance < t_max):
                hit = no_hit()
            return self.with_exact_distance(ray, hit, t_min, t_max)
        return self.with_exact_distance(ray, self.search(ray, t_min, t_max, False), t_min, t_max)

    @ti.func
    def is_blocked(self, ray, t_min, t_max):
        """Whether anything is hit with t_min < t < t_max."""
        if ti.static("is_occluded" in self.replaced):
            return self.is_occluded(Ray(origin=ray.at(t_min), direction=ray.direction), t_max - t_min)
        if ti.static("query_ray" in self.replaced):
            return self.query_segment(ray, t_min, t_max).is_hit != 0
        return self.search(ray, t_min, t_max, True).is_hit != 0

    @ti.func
    def try_primitive(self, ray, bounds, primitive_id, t_min):
        """(t, u, v) of the ray on one triangle or sphere, beyond t_min if it is a sphere; t is −∞ for a miss."""
        t, u, v, index = -tm.inf, 0.0, 0.0, primitive_id
        if ti.static(self.geometry.effects.spheres):
            index = self.geometry.primitives[primitive_id]
            if index < 0:
                t = self.sphere_candidate(ray, bounds, -1 - index, t_min)
        if index >= 0:
            if ti.static("intersect_triangle" in self.replaced):
                hit = self.intersect_triangle(ray, index)
                u, v = hit.barycentric_coords.x, hit.barycentric_coords.y
                if hit.is_hit and not self.is_hole(index, u, v):
                    t = hit.distance
            else:
                t, u, v = self.try_corners(ray, bounds, primitive_id, index, self.geometry.triangle(index), 1)
        return t, u, v

    @ti.func
    def found(self, ray, t, primitive_id, u, v, any_hit: ti.template()):
        """What ``search`` returns for the best that it found; ``primitive_id`` is −1 if it found nothing."""
        hit = no_hit()
        if primitive_id >= 0:
            if ti.static(any_hit):
                hit.is_hit = 1
            else:
                hit = self.describe(ray, t, primitive_id, u, v)
        return hit

    @ti.func
    def describe(self, ray, t, primitive_id, u, v):
        """HitData of one primitive, from what ``try_primitive`` found."""
        if ti.static(not self.geometry.effects.spheres):
            return self.describe_nearest(ray, t, primitive_id, u, v)
        hit, index = no_hit(), self.geometry.primitives[primitive_id]
        if index < 0:
            hit = self.describe_sphere(ray, t, -1 - index)
        else:
            hit = self.describe_nearest(ray, t, index, u, v)
        hit.triangle_id = primitive_id
        return hit

    @ti.func
    def describe_nearest(self, ray, t, triangle_id, u, v):
        """HitData of the nearest triangle, once it is found; a replaced ``intersect_triangle`` says it."""
        if ti.static("intersect_triangle" in self.replaced):
            return self.intersect_triangle(ray, triangle_id)
        return self.describe_triangle(ray, t, triangle_id, u, v, self.geometry.triangle(triangle_id))

    @ti.func
    def with_exact_distance(self, ray, hit, t_min, t_max):
        """``hit`` with what only the nearest hit needs.

        The t of the nearest hit is computed again, as exactly as possible; for one hit, this costs little time. A hit
        that a student's method returns keeps its values. Only the members that the method did not set are added: the
        normal of the triangle's plane, the position and its error.
        """
        if hit.is_hit:
            if ti.static("intersect_triangle" in self.replaced or "query_ray" in self.replaced):
                if tm.component_sum(abs(hit.geometric_normal)) == 0:
                    triangle_id = hit.triangle_id
                    if ti.static(self.geometry.effects.spheres and "query_ray" not in self.replaced):
                        triangle_id = self.geometry.primitives[triangle_id]
                    n = self.geometry.unit_normals[tm.clamp(triangle_id, 0, self.geometry.n_triangles - 1)]
                    hit.geometric_normal = ti.select(tm.dot(ray.direction, n) > 0, -n, n)
                    hit.position = ray.at(hit.distance)
                    reach = abs(ray.origin) + abs(hit.distance * ray.direction)
                    hit.position_error = self.pad_factor * (reach + tm.component_max(reach))
            else:
                index = hit.triangle_id
                if ti.static(self.geometry.effects.spheres):
                    index = self.geometry.primitives[hit.triangle_id]
                if index >= 0:  # the t of a sphere is exact already
                    hit.distance = self.exact_distance(ray, hit.distance, self.geometry.triangle(index), t_min, t_max)
        elif ti.static(len(self.replaced) > 0):
            hit = no_hit()
        return hit

    # ── one triangle, one sphere ──

    @ti.func
    def triangle_hit(self, ray, triangle_id, t_min):
        """HitData of one triangle beyond t_min; a replaced ``intersect_triangle`` may ask it, too."""
        corners, hit = self.geometry.triangle(triangle_id), no_hit()
        if self.is_legal(ray):
            t, u, v = self.try_corners(ray, self.ray_bounds(ray), triangle_id, triangle_id, corners, 1)
            if t_min < t:
                hit = self.describe_triangle(ray, t, triangle_id, u, v, corners)
        return hit

    @ti.func
    def try_corners(self, ray, bounds, primitive_id, triangle_id, corners, facing):
        """(t, u, v) of the ray on one triangle; t is −∞ if the ray misses it, or comes from a back that it passes.

        Args:
            primitive_id: its id among all primitives, which those who watch want to know.
            facing: −1 if the corners are those of a mirror image, whose front stays a front, else 1.
        """
        v0, v1, v2 = corners
        is_inside, distance, u, v, det = self.solve(ray.origin, ray.direction, v0, v1, v2)
        t = -tm.inf
        if is_inside and det != 0:
            t = within_box(bounds, distance, v0, v1, v2)
        if ti.static(self.geometry.effects.culling):
            if self.geometry.culls[triangle_id] != 0 and tm.dot(ray.direction, stable_normal(v0, v1, v2)) * facing > 0:
                t = -tm.inf
        if t > -tm.inf and self.is_hole(triangle_id, u, v):
            t = -tm.inf
        return t, u, v

    @ti.func
    def is_hole(self, triangle_id, u, v):
        """Whether the texture of a triangle has a hole at a point."""
        if ti.static(self.geometry.effects.holes):
            material_id = self.geometry.triangle_material_ids[triangle_id]
            return self.geometry.textures.is_hole(material_id, triangle_id, u, v)
        return False

    @ti.func
    def is_legal(self, ray):
        """Whether the direction is not 0 and all numbers are finite. Every other ray misses everything."""
        size = tm.component_sum(abs(ray.direction))
        return tm.component_sum(abs(ray.origin)) + size < tm.inf and size > 0

    @ti.func
    def ray_bounds(self, ray):
        """``ray`` prepared for ``box_interval``."""
        o, d = ray.origin, ray.direction
        low, high = tm.vec3(self.geometry.corners[0]), tm.vec3(self.geometry.corners[1])
        reach = tm.component_max(ti.max(abs(low - o), abs(high - o)))
        pad = self.pad_factor * (reach + abs(o) / 4)  # abs(o) / 4 covers the rounding of o ± pad
        inverse = 1 / d
        towards = ti.select(inverse >= 0, pad, -pad)
        return RayBounds(inverse=inverse, near_origin=o + towards, far_origin=o - towards)

    @ti.func
    def sphere_candidate(self, ray, bounds, sphere_id, t_min):
        """t where the ray enters a sphere; where it leaves it, if the entry is not beyond t_min; −∞ if it misses it.

        t is clamped to the box of the sphere, for the reason that ``within_box`` gives.
        """
        centre, radius = self.geometry.spheres[sphere_id].xyz, self.geometry.spheres[sphere_id].w
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
    def describe_triangle(self, ray, t, triangle_id, u, v, corners):
        """HitData from t and barycentric coordinates. Both normals face the origin of the ray (A1-13, C-17)."""
        geometric_normal = self.geometry.unit_normals[triangle_id]
        normal = self.geometry.shading_normal(triangle_id, u, v, geometric_normal)
        position, position_error = self.geometry.position(u, v, *corners, self.geometry.thinness[triangle_id])
        material_id = self.geometry.triangle_material_ids[triangle_id]
        hit = facing_hit(ray, t, tm.vec2(u, v), normal, geometric_normal, material_id, position, position_error)
        hit.triangle_id = triangle_id
        return hit

    @ti.func
    def describe_sphere(self, ray, t, sphere_id):
        """HitData of a sphere without its number; its (u, v) are longitude and latitude, each from 0 to 1.

        The position is c + r n. This point lies on the sphere at any distance from the origin of the ray. Its rounding
        error is a few ε of |c| + r.
        """
        centre, radius = self.geometry.spheres[sphere_id].xyz, self.geometry.spheres[sphere_id].w
        n = sphere_normal(widened(ray.origin), widened(ray.direction), widened(centre), widened(radius), t)
        error = (abs(centre) + radius) * ti.static(8 * runtime.epsilon())
        material_id = self.geometry.sphere_material_ids[sphere_id]
        return facing_hit(ray, t, longitude_latitude(n), n, n, material_id, centre + radius * n, error)

    @ti.func
    def exact_distance(self, ray, distance, corners, t_min, t_max):
        """t of a hit on the triangle with these corners, computed again in f64 if the backend has f64.

        The new t must lie between t_min and t_max, otherwise the old one is kept. Without this rule, a loop that
        searches from each hit to the next could find the same hit for ever.
        """
        if ti.static(runtime.can_widen()):
            t_near, t_far = triangle_interval(self.ray_bounds(ray), *corners)
            exact = plane_distance(ray.origin, ray.direction, *corners)
            if t_near <= exact and exact <= t_far and t_min < exact and exact < t_max:
                distance = exact
        return distance


@ti.func
def facing_hit(ray, t, uv, normal, geometric_normal, material_id, position, position_error):
    """HitData without a number. The normals are given on the outside; they become those that face the ray's origin."""
    is_backfacing = tm.dot(ray.direction, geometric_normal) > 0
    facing = ti.select(is_backfacing, -1, 1)
    return HitData(
        is_hit=1,
        is_backfacing=is_backfacing,
        triangle_id=-1,
        distance=t,
        barycentric_coords=uv,
        normal=facing * normal,
        geometric_normal=facing * geometric_normal,
        material_id=material_id,
        position=position,
        position_error=position_error,
    )


@register
@ti.data_oriented
@overridable()
class BruteForceRayIntersector(RayIntersector):
    """Tries every triangle. A student writes this form first; every hierarchy must give the same answers (A1-14)."""

    name = "brute_force"
