"""The part of a scene that kernels use: what is along a ray, and what lights a surface."""

from typing import TYPE_CHECKING

import taichi as ti
from taichi.lang import impl

from taichi_tracer.brdfs.surface import Surface
from taichi_tracer.effects import Effects
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.boxes import box_interval
from taichi_tracer.lights.environment_light import EnvironmentLight
from taichi_tracer.lights.scene_lights import SceneLights
from taichi_tracer.materials import textured
from taichi_tracer.ray import Ray, no_hit, offset_origin
from taichi_tracer.system.compile_time import compile_time, element, variable
from taichi_tracer.system.parts import replaced

if TYPE_CHECKING:
    from taichi_tracer.scene_data import SceneData


@ti.data_oriented
class SceneInKernels:
    """The part of a scene that kernels use, compiled for its effects. After a change of the scene, it is another one.

    Attributes:
        geometry, ray_intersector, material_library, textures, environment, background: those of ``SceneData``.
        lights: all lights, see ``lights.scene_lights``.
        effects: what is compiled, see ``effects.Effects``.
        samples_lights: whether directions are drawn from the lights. All lamps of a scene may be without area.
        microfacets: whether the roughness decides where a material has both Ns and a roughness.
        compensates: whether samples of the environment leave out what samples of the BRDF find, see
            ``lights.environment_light``.
        search: the intersector of ``SceneData``, also in a copy in which ``ray_intersector`` is observed.
    """

    def __init__(
        self, scene: "SceneData", effects: Effects, compensates: bool = False, microfacets: bool = False
    ) -> None:
        self.effects, self.compensates, self.microfacets = effects, compensates, microfacets
        self.geometry, self.ray_intersector = scene.geometry, scene.ray_intersector
        self.search = scene.ray_intersector
        self.material_library, self.textures = scene.material_library, scene.geometry.textures
        self.environment, self.background = scene.environment, scene.background
        has_far = scene.environment is not None and effects.environment in ("constant", "image")
        far = [EnvironmentLight(scene.environment, effects, scene.up_axis, compensates)] if has_far else []
        self.lights = SceneLights([*far, *scene.lights], scene.lamps if effects.emitters else None)
        self.samples_lights = effects.samples_lights and self.lights.can_be_met

    @compile_time
    def material_at(self, hit):
        """The numbers of the material of a hit, coloured by its texture."""
        material = impl.expr_init(self.material_library.get(hit.material_id))
        return impl.expr_init(textured(material, self.textures, hit)) if self.effects.textures else material

    @compile_time
    def surface_at(self, ray, hit) -> Surface:
        """The surface that a ray hit."""
        library = self.material_library
        brdfs = {i: library.brdfs[i] for i in self.effects.brdfs}
        material = self.material_at(hit)
        if any(brdf.transmits for brdf in brdfs.values()):
            material = variable(seen_from(material, hit.is_backfacing))
        brdf_id = variable(element(library.brdf_ids, library.row(hit.material_id), int(self.microfacets)))
        origin = variable(offset_origin(hit.position, hit.position_error, hit.geometric_normal))
        return Surface(brdfs, brdf_id, material, origin, hit, variable(-ray.direction))

    @ti.func
    def emitted(self, ray, hit, rng):
        """Radiance along a ray without any reflection: from an emitting surface, or from behind the scene."""
        L = tm.vec3(0)
        if hit.is_hit:
            if ti.static(self.effects.emitters):
                L = self.lights.lamps.emitted(hit)
        else:
            L = self.behind(ray, hit, rng)
        return L

    @ti.func
    def behind(self, ray, hit, rng):
        """What a ray shows if it hits nothing: the background of the picture, or the lights that it sees."""
        if ti.static(self.effects.background):
            return self.background.color(rng.x, rng.y, rng.sampler.width, rng.sampler.height)
        value = self.lights.arriving(ray, hit)
        for light in ti.static(self.lights.single):
            value += light.radiance(ray, hit)
        return value

    @ti.func
    def may_find_light(self, ray):
        """Whether a ray may meet light: not if it passes the box of all lamps, and no light is far away.

        Where a student's method finds what a ray hits, this may be a lamp anywhere.
        """
        if ti.static(len(self.lights.far) > 0 or len(replaced(self.search)) > 0):
            return True
        if ti.static(not self.lights.has_lamps):
            return False
        low, high = self.lights.lamps.corners[0], self.lights.lamps.corners[1]
        bounds = self.ray_intersector.ray_bounds(ray)
        t_near, t_far = box_interval(bounds, tm.vec3(low), tm.vec3(high), 0.0, tm.inf)
        return t_near <= t_far

    @ti.func
    def visible_radiance(self, surface, w_i, factor):
        """Radiance that arrives at a surface from w_i; 0 if something blocks it.

        The caller multiplies the result by ``factor``. If ``factor`` is 0, no light is looked up and no ray is sent.
        """
        light, _ = self.visible(surface, w_i, factor)
        return light

    @ti.func
    def visible(self, surface, w_i, factor):
        """(radiance, HitData): ``visible_radiance``, and what the ray along w_i hits.

        In a scene without lamps, it is enough to know whether the ray hits anything: nothing else of the hit is found.
        """
        light, hit = tm.vec3(0), no_hit()
        if tm.component_max(factor) > 0 and surface.lets_pass(w_i):
            ray = surface.ray_along(w_i)
            if ti.static(self.lights.has_lamps):
                hit = self.met(surface, ray)
                light = self.lights.arriving(ray, hit)
            else:
                light = self.lights.from_far.radiance(ray, hit)
                if tm.component_max(light) > 0:
                    hit.is_hit = self.is_blocked(surface, w_i, tm.inf)
                    if hit.is_hit:
                        light = tm.vec3(0)
        return light, hit

    @ti.func
    def reflected_single(self, surface, rng):
        """Light of the ``single`` lights that a surface reflects to the viewer: one sample of each light."""
        total = self.lights.reflected_ambient(surface.material)
        for k in range(ti.static(len(self.lights.drawn))):
            xi = rng.next_2d_of_term()
            w_i, distance, light, pdf = self.lights.sample_drawn(k, surface.origin, xi)
            f_cos = surface.eval(w_i) * ti.max(0.0, tm.dot(surface.normal, w_i))
            light = f_cos * light / pdf
            if tm.component_max(light) > 0 and tm.dot(surface.geometric_normal, w_i) > 0:
                if not self.is_blocked(surface, w_i, distance):
                    total += light
        return total

    @ti.func
    def is_blocked(self, surface, w_i, distance):
        """Whether anything lies between a surface and a light in the direction w_i; if nothing can, no ray is sent."""
        blocked = False
        if ti.static(self.effects.blockers != "none"):
            if may_meet(self.effects, surface, w_i):
                blocked = self.ray_intersector.is_occluded(Ray(origin=surface.origin, direction=w_i), distance)
        return blocked

    @ti.func
    def met(self, surface, ray):
        """HitData of what a ray hits that leaves a surface; if it can hit nothing, it is not traced."""
        hit = no_hit()
        if ti.static(self.effects.blockers != "none"):
            if may_meet(self.effects, surface, ray.direction):
                hit = self.ray_intersector.query_segment(ray, 0.0, tm.inf)
        return hit


@ti.func
def seen_from(material, is_backfacing):
    """The material, with the index of refraction behind the surface divided by that on the viewer's side."""
    seen = material
    seen.Ni = ti.select(is_backfacing, 1 / material.Ni, material.Ni)
    return seen


@ti.func
def may_meet(effects: ti.template(), surface, w_i):
    """Whether a ray that leaves a surface can hit anything, see ``Effects.blockers``."""
    if ti.static(effects.blockers == "backs"):
        return surface.hit.is_backfacing != 0 or tm.dot(surface.geometric_normal, w_i) <= 0
    return True
