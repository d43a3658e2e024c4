from enum import IntEnum
from typing import List
import taichi as ti
import taichi.math as tm

from .scene_data import SceneData
from .camera import Camera
from .ray import Ray, HitData
from .sampler import UniformSampler, BRDF

@ti.data_oriented
class A1Renderer:
    class ShadeMode(IntEnum):
        HIT = 1
    def __init__(self, width, height, scene_data): pass

@ti.data_oriented
class A2Renderer:
    class SampleMode(IntEnum):
        UNIFORM = 1
        BRDF = 2
        MICROFACET = 3

    def __init__(self, width: int, height: int, scene_data: SceneData) -> None:
        self.RAY_OFFSET = 1e-6
        self.width = width
        self.height = height
        self.camera = Camera(width=width, height=height)
        self.canvas = ti.Vector.field(n=3, dtype=float, shape=(width, height))
        self.iter_counter = ti.field(dtype=float, shape=())
        self.scene_data = scene_data
        self.sample_mode = ti.field(shape=(), dtype=int)

    @ti.kernel
    def render(self):
        for x, y in ti.ndrange(self.width, self.height):
            ray = self.camera.generate_ray(x, y, True)
            self.canvas[x, y] += (self.shade_ray(ray) - self.canvas[x, y]) / self.iter_counter[None]

    @ti.func
    def shade_ray(self, ray: Ray) -> tm.vec3:
        color = tm.vec3(0.)
        hit_data = self.scene_data.ray_intersector.query_ray(ray)
        if hit_data.is_hit:
            material = self.scene_data.material_library.materials[hit_data.material_id]
            x = ray.origin + hit_data.distance * ray.direction
            w_o = -ray.direction
            n = hit_data.normal
            if self.sample_mode[None] == int(self.SampleMode.UNIFORM):
                w_i = UniformSampler.sample_direction()
                pdf = UniformSampler.evaluate_probability()
                shadow = Ray()
                shadow.origin = x + self.RAY_OFFSET * n
                shadow.direction = w_i
                if not self.scene_data.ray_intersector.query_ray(shadow).is_hit:
                    L = self.scene_data.environment.query_ray(shadow)
                    color = L * BRDF.evaluate_brdf(material, w_o, w_i, n) * ti.max(0., n.dot(w_i)) / pdf
            elif self.sample_mode[None] == int(self.SampleMode.BRDF):
                w_i = BRDF.sample_direction(material, w_o, n)
                shadow = Ray()
                shadow.origin = x + self.RAY_OFFSET * n
                shadow.direction = w_i
                if not self.scene_data.ray_intersector.query_ray(shadow).is_hit:
                    L = self.scene_data.environment.query_ray(shadow)
                    color = L * BRDF.evaluate_brdf_factor(material, w_i, n)
        else:
            color = self.scene_data.environment.query_ray(ray)
        return color


@ti.data_oriented
class A3Renderer:
    class SampleMode(IntEnum):
        UNIFORM = 1
        BRDF = 2
        LIGHT = 3
        MIS = 4

    def __init__(self, width: int, height: int, scene_data: SceneData) -> None:
        self.scene_data = scene_data
        self.mis_plight = ti.field(dtype=float, shape=())

    @ti.func
    def light_pdf(self, hit, w, ray_o) -> float:
        # hit is a light that the ray found
        p = 0.0
        c = ti.abs(hit.normal.dot(w))
        if c > 0:
            p = self.scene_data.mesh_light_sampler.evaluate_probability() * hit.distance * hit.distance / c
        return p

    @ti.func
    def shade_ray(self, ray: Ray) -> tm.vec3:
        color = tm.vec3(0.)
        hit = self.scene_data.ray_intersector.query_ray(ray)
        if hit.is_hit:
            m = self.scene_data.material_library.materials[hit.material_id]
            if m.Ke.norm() > 0:
                if not hit.is_backfacing:
                    color = m.Ke
            else:
                x = ray.origin + hit.distance * ray.direction
                n = hit.normal
                w_o = -ray.direction
                pl = 0.0
                if self.sample_mode[None] == int(self.SampleMode.LIGHT):
                    pl = 1.0
                elif self.sample_mode[None] == int(self.SampleMode.MIS):
                    pl = self.mis_plight[None]
                w = tm.vec3(0.)
                light_id = -1  # that of a sample of the BRDF
                if ti.random() < pl:
                    w, light_id = self.scene_data.mesh_light_sampler.sample_mesh_lights(x)
                else:
                    w = BRDF.sample_direction(m, w_o, n)
                s = Ray()
                s.origin = x + 1e-4 * n
                s.direction = w
                h = self.scene_data.ray_intersector.query_ray(s)
                is_visible = h.is_hit and (light_id == -1 or h.triangle_id == light_id)
                if is_visible and n.dot(w) > 0 and not h.is_backfacing:
                    Le = self.scene_data.material_library.materials[h.material_id].Ke
                    if Le.norm() > 0:
                        pdf = pl * self.light_pdf(h, w, x) + (1 - pl) * BRDF.evaluate_probability(m, w_o, w, n)
                        if pdf > 0:
                            color = Le * BRDF.evaluate_brdf(m, w_o, w, n) * n.dot(w) / pdf
        return color


@ti.data_oriented
class A4Renderer:
    class ShadingMode(IntEnum):
        IMPLICIT = 1
        EXPLICIT = 2

    def __init__(self, width: int, height: int, scene_data: SceneData) -> None:
        self.max_bounces = ti.field(dtype=int, shape=())

    @ti.func
    def shade_implicit(self, ray: Ray) -> tm.vec3:
        color = tm.vec3(0.)
        beta = tm.vec3(1.)
        r = Ray()
        r.origin = ray.origin
        r.direction = ray.direction
        bounce = 0
        while bounce <= self.max_bounces[None]:
            hit = self.scene_data.ray_intersector.query_ray(r)
            if not hit.is_hit:
                color += beta * self.scene_data.environment.query_ray(r)
                break
            m = self.scene_data.material_library.materials[hit.material_id]
            if m.Ke.norm() > 0 and not hit.is_backfacing:
                color += beta * m.Ke
            w = BRDF.sample_direction(m, -r.direction, hit.normal)
            beta *= BRDF.evaluate_brdf_factor(m, w, hit.normal)
            x = r.origin + hit.distance * r.direction
            r.origin = x + 1e-4 * hit.normal
            r.direction = w
            bounce += 1
            if bounce > 1:
                if ti.random() < self.rr_termination_probabilty[None]:
                    break
                beta /= 1 - self.rr_termination_probabilty[None]
        return color

    @ti.func
    def shade_explicit(self, ray: Ray) -> tm.vec3:
        color = tm.vec3(0.)
        beta = tm.vec3(1.)
        r = Ray()
        r.origin = ray.origin
        r.direction = ray.direction
        bounce = 0
        while bounce <= self.max_bounces[None]:
            hit = self.scene_data.ray_intersector.query_ray(r)
            if not hit.is_hit:
                break
            m = self.scene_data.material_library.materials[hit.material_id]
            if m.Ke.norm() > 0:
                if bounce == 0 and not hit.is_backfacing:
                    color += m.Ke
            n = hit.normal
            x = r.origin + hit.distance * r.direction + 1e-4 * n
            if bounce < self.max_bounces[None]:
                w, light_id = self.scene_data.mesh_light_sampler.sample_mesh_lights(x)
                s = Ray()
                s.origin = x
                s.direction = w
                h = self.scene_data.ray_intersector.query_ray(s)
                if h.is_hit and h.triangle_id == light_id and not h.is_backfacing:
                    Le = self.scene_data.material_library.materials[h.material_id].Ke
                    f = BRDF.evaluate_brdf(m, -r.direction, w, n)
                    p = self.scene_data.mesh_light_sampler.evaluate_probability()
                    color += beta * Le * f * ti.max(0., n.dot(w)) * ti.max(0., h.normal.dot(-w)) / (p * h.distance * h.distance)
            w_i = BRDF.sample_direction(m, -r.direction, n)
            beta *= BRDF.evaluate_brdf_factor(m, w_i, n)
            r.origin = x
            r.direction = w_i
            bounce += 1
            if bounce > 1:
                if ti.random() < self.rr_termination_probabilty[None]:
                    break
                beta /= 1 - self.rr_termination_probabilty[None]
        return color
