"""The surfaces of a scene that emit light, all together as one light: triangles and spheres whose material has Ke > 0.

A sample chooses a lamp (``choice``), then a point y on it. Densities are per solid angle, seen from the point x that is
lit (A3-3). On a triangle that looks small from x, the point is uniform in area:

    p(ω) = P(lamp) / area · |x − y|² / cos θ_y

A triangle that looks large, and a sphere, is sampled uniformly in its solid angle Ω: p(ω) = P(lamp) / Ω.
"""

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.area_lights import (
    cone_of_sphere,
    solid_angle,
    uniform_cone,
    uniform_spherical_triangle,
    uniform_triangle,
)
from taichi_tracer.formulas.luminance import luminance
from taichi_tracer.formulas.spheres import sphere_roots, widened
from taichi_tracer.formulas.triangles import moller_trumbore, unit
from taichi_tracer.geometry import Geometry
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.choice import LampChoice, LampTable
from taichi_tracer.materials import MaterialLibrary
from taichi_tracer.ray import offset_origin
from taichi_tracer.system import runtime
from taichi_tracer.system.memory import Memory, filled, varying
from taichi_tracer.system.parts import call_with_known_args, overridable

# A triangle is near if its middle is closer than this, in units of the radius of a ball around it. Then points are
# uniform in solid angle, which takes more time for a sample, and makes samples equally bright.
NEAR = 3.0
# In units of the square of the scene's longest side: only a small part of a scene is near to lamps that are smaller
# than this. There, the time that every sample would take is worth more.
SMALL_LAMP = 0.1


@ti.data_oriented
@overridable()
class Lamps(Light):
    """All surfaces of a scene that emit light. A triangle emits from its front (A3-1); ``two_sided`` adds its back.

    Args:
        geometry, library: the primitives and materials of the scene.
        choice: how one of the lamps is chosen for a sample.
        two_sided: whether triangles emit from both sides.

    Attributes:
        count: the number of lamps. corners: the low and the high corner of a box around all of them,
            rounded outwards to the running precision.
        has_near: whether a surface may be near a lamp. It is asked once, for the whole scene: the code for this case is
            compiled only if a lamp is larger than ``SMALL_LAMP``.
    """

    name = "lamps"

    def __init__(
        self, geometry: Geometry, library: MaterialLibrary, choice: LampChoice, two_sided: bool = False
    ) -> None:
        self.geometry, self.library, self.choice, self.two_sided = geometry, library, choice, bool(two_sided)
        self.table = lamp_table(geometry, library.materials, self.two_sided)
        self.count = varying(len(self.table))
        low, high = self.table.low.min(axis=0, initial=np.inf), self.table.high.max(axis=0, initial=-np.inf)
        dtype = runtime.dtype()
        low, high = np.nextafter(low.astype(dtype), dtype(-np.inf)), np.nextafter(high.astype(dtype), dtype(np.inf))
        self.corners = varying((tuple(low.tolist()), tuple(high.tolist())))
        self._memory: Memory | None = None
        size = np.ptp(geometry.mesh.vertices, axis=0).max() if len(geometry.mesh.vertices) > 0 else 0.0
        is_large = self.table.areas.max(initial=0) > SMALL_LAMP * size * size
        self.has_near = bool(is_large) and not choice.keeps_area and not choice.samples_points

    def prepare(self) -> None:
        """Build the tables that ``sample`` and ``pdf`` read."""
        if self._memory is not None or self.count == 0:
            return
        table = self.table
        centre = (table.low + table.high) / 2
        radius = np.linalg.norm(table.high - table.low, axis=1, keepdims=True) / 2
        balls = np.concatenate([centre, radius], axis=1)  # around each lamp
        lamp_of = np.full(self.geometry.n_primitives, -1)
        lamp_of[table.ids] = np.arange(self.count)
        self._memory, fields = filled(table.primitives, table.areas, balls, lamp_of)
        self.primitives, self.areas, self.balls, self.lamp_of = fields
        self.choice.geometry = self.geometry
        self.choice.prepare(self.table)

    @ti.func
    def emitted(self, hit):
        """Radiance that a hit emits towards the origin of its ray: Ke, if the side that the ray hit emits (A3-1)."""
        light = tm.vec3(0)
        if hit.is_hit and (self.two_sided or not hit.is_backfacing):
            light = self.library.value(hit.material_id, "Ke")
        return light

    @ti.func
    def sample_from(self, x, n, xi):
        """(w_i, distance, radiance, pdf) of a direction from the point x with the normal n to a point on a lamp.

        The light is 0 if the lamp does not emit towards x. The first random number chooses the lamp; what it leaves
        and the second choose the point on it.
        """
        if ti.static(self.choice.samples_points):
            return self.sample_of_choice(x)
        lamp, probability, rest = self.choice.choose(x, n, xi.x)
        place = tm.vec2(rest, xi.y)
        if ti.static(not self.geometry.effects.spheres):
            w_i, distance, light, pdf = self.sample_triangle(x, lamp, place)
            return w_i, distance, light, pdf * probability
        w_i, distance, light, pdf = tm.vec3(0, 1, 0), 1.0, tm.vec3(0), 1.0
        primitive = self.primitives[lamp]
        if primitive >= 0:
            w_i, distance, light, pdf = self.sample_triangle(x, lamp, place)
        else:
            w_i, distance, light, pdf = self.sample_sphere(x, -1 - primitive, place)
        return w_i, distance, light, pdf * probability

    @ti.func
    def sample_of_choice(self, x):
        """(w_i, distance, radiance, pdf) of a direction that the choice itself samples, see ``samples_points``."""
        w_i, triangle_id = call_with_known_args(self.choice.sample_mesh_lights, x)
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        n = self.geometry.unit_normals[triangle_id]
        cosine = -tm.dot(w_i, n)
        if ti.static(self.two_sided):
            cosine = abs(cosine)
        distance, light, pdf = 1.0, tm.vec3(0), 1.0
        if cosine > 0:
            distance = tm.dot(v0 - x, n) / tm.dot(w_i, n)
            light = self.library.value(self.geometry.triangle_material_ids[triangle_id], "Ke")
            pdf = call_with_known_args(self.choice.evaluate_probability) * distance * distance / cosine
        # Shortened by the rounding of the distance, so that the triangle does not block its own light.
        return w_i, distance * (1 - ti.static(16 * runtime.epsilon())), light, pdf

    @ti.func
    def sample_triangle(self, x, lamp, xi):
        """(w_i, distance, radiance, pdf) of a point uniform on a lamp that is a triangle.

        The point is moved off the triangle by the rounding error of a ray from x, so that the triangle does not block
        its own light.
        """
        triangle_id, place = self.primitives[lamp], uniform_triangle(xi)
        omega = self.large_solid_angle(x, lamp)
        if omega > 0:
            place = self.place_in_solid_angle(x, triangle_id, omega, xi)
        thinness = self.geometry.thinness[triangle_id]
        y, error = self.geometry.position(place.x, place.y, *self.geometry.triangle(triangle_id), thinness)
        n = self.geometry.unit_normals[triangle_id]
        is_front = tm.dot(x - y, n) > 0
        facing = ti.select(is_front, n, -n)
        to_x = tm.component_max(abs(x - y)) * ti.static(8 * runtime.epsilon())
        end = offset_origin(y, error + to_x, facing)
        distance = tm.length(end - x)
        w_i = (end - x) / ti.max(distance, ti.static(runtime.smallest()))
        cosine = -tm.dot(w_i, facing)
        light, pdf = tm.vec3(0), 1.0
        if distance > 0 and cosine > 0 and (self.two_sided or is_front):
            light = self.library.value(self.geometry.triangle_material_ids[triangle_id], "Ke")
            pdf = distance * distance / (self.areas[lamp] * cosine)
            if omega > 0:
                pdf = 1 / omega
        return w_i, distance, light, pdf

    @ti.func
    def large_solid_angle(self, x, lamp):
        """The solid angle in which x sees a lamp that is a triangle, if x is near it; 0 if it is far away."""
        omega = 0.0
        if ti.static(self.has_near):
            ball = self.balls[lamp]
            if tm.length(x - ball.xyz) < NEAR * ball.w:
                v0, v1, v2 = self.geometry.triangle(self.primitives[lamp])
                omega = solid_angle(v0 - x, v1 - x, v2 - x)
        return omega

    @ti.func
    def place_in_solid_angle(self, x, triangle_id, omega, xi):
        """(u, v) of a point of a triangle that x sees in the solid angle omega, uniform in this solid angle."""
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        d = uniform_spherical_triangle(unit(v0 - x), unit(v1 - x), unit(v2 - x), omega, xi)
        is_inside, t, u, v, det = moller_trumbore(x, d, v0, v1, v2)
        u = tm.clamp(u, 0.0, 1.0)
        return tm.vec2(u, tm.clamp(v, 0.0, 1 - u))

    @ti.func
    def sample_sphere(self, x, sphere_id, xi):
        """(w_i, distance, radiance, pdf) of a direction uniform in the cone in which x sees a sphere."""
        centre, radius = self.geometry.spheres[sphere_id].xyz, self.geometry.spheres[sphere_id].w
        to_centre = centre - x
        far = tm.length(to_centre)
        w_i, distance, light, pdf = tm.vec3(0, 1, 0), 1.0, tm.vec3(0), 1.0
        if far > radius:
            drop = cone_of_sphere(far, radius)
            w_i = uniform_cone(to_centre / far, drop, xi)
            met, t_in, t_out = sphere_roots(widened(x), widened(w_i), widened(centre), widened(radius))
            # Shortened by the rounding of t, so that the sphere does not block its own light.
            distance = ti.select(met, ti.cast(t_in, float), tm.dot(w_i, to_centre))
            distance *= 1 - ti.static(16 * runtime.epsilon())
            light = self.library.value(self.geometry.sphere_material_ids[sphere_id], "Ke")
            pdf = 1 / (2 * tm.pi * drop)
        return w_i, distance, light, pdf

    @ti.func
    def pdf_from(self, x, n, w_i, hit):
        """The density of ``sample_from`` at w_i; ``hit`` is what the ray from x along the unit vector w_i hits."""
        pdf = 0.0
        if hit.is_hit:
            lamp = self.lamp_of[self.geometry.number(hit.triangle_id)]
            if lamp >= 0 and (self.two_sided or not hit.is_backfacing):
                cosine = ti.max(-tm.dot(w_i, hit.geometric_normal), ti.static(runtime.smallest()))
                pdf = hit.distance * hit.distance / (self.areas[lamp] * cosine)
                primitive, omega = self.primitives[lamp], 0.0
                if primitive >= 0:
                    omega = self.large_solid_angle(x, lamp)
                if ti.static(self.geometry.effects.spheres):
                    if primitive < 0:
                        sphere = self.geometry.spheres[-1 - primitive]
                        far = tm.length(sphere.xyz - x)
                        omega = ti.select(far > sphere.w, 2 * tm.pi * cone_of_sphere(far, sphere.w), tm.inf)
                if omega > 0:
                    pdf = 1 / omega
                pdf *= self.choice.probability(x, n, lamp)
        return pdf


def lamp_table(geometry: Geometry, materials: tuple, two_sided: bool) -> LampTable:
    """The table of the primitives that emit. Primitives that no ray can hit, and those without area, are left out."""
    mesh = geometry.mesh
    colors = np.array([m.Ke for m in materials], np.float64).reshape(-1, 3)
    emits = colors.max(axis=1, initial=0) > 0
    face_materials = np.asarray(mesh.face_materials)
    number = mesh.primitives()
    triangle_ids, sphere_ids = np.flatnonzero(number >= 0), np.flatnonzero(number < 0)

    emitting = np.flatnonzero(emits[face_materials])
    v = mesh.vertices[mesh.faces[emitting]].astype(np.float64)  # (n, 3, 3)
    cross = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    has_area = twice > 0
    triangles, v, cross, twice = emitting[has_area], v[has_area], cross[has_area], twice[has_area]
    radius = mesh.spheres[:, 3].astype(np.float64)
    spheres = np.flatnonzero(emits[mesh.sphere_materials] & (radius > 0))

    materials_of = np.concatenate([face_materials[triangles], mesh.sphere_materials[spheres]]).astype(np.int64)
    centres, r = mesh.spheres[spheres, :3].astype(np.float64), radius[spheres, None]
    return LampTable(
        primitives=np.concatenate([triangles, -1 - spheres]).astype(np.int32),
        ids=np.concatenate([triangle_ids[triangles], sphere_ids[spheres]]).astype(np.int32),
        materials=materials_of,
        areas=np.concatenate([twice / 2, 4 * np.pi * r[:, 0] ** 2]),
        radiance=luminance(colors[materials_of]),
        low=np.concatenate([v.min(axis=1), centres - r]),
        high=np.concatenate([v.max(axis=1), centres + r]),
        normals=np.concatenate([cross / twice[:, None], np.zeros((len(spheres), 3))]),
        two_sided=two_sided,
    )
