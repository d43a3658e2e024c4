"""Assignment rt3_lights as student one writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class PointLight(tt.PointLight):
    @ti.func
    def sample(self, x, xi):
        p = tm.vec3(self.position[0], self.position[1], self.position[2])
        Kc, Kl, Kq = self.attenuation[0], self.attenuation[1], self.attenuation[2]
        d = p - x
        r = ti.sqrt(d.x * d.x + d.y * d.y + d.z * d.z)
        factor = 1 / (Kc + r * (Kl + r * Kq))
        return tm.normalize(d), r, factor * tm.vec3(self.intensity), 1.0


@ti.data_oriented
class DirectionalLight(tt.DirectionalLight):
    @ti.func
    def sample(self, x, xi):
        to_sun = -1 * tm.vec3(self.direction)
        return to_sun / to_sun.norm(), tm.inf, tm.vec3(self.irradiance), 1.0


@ti.data_oriented
class SpotLight(tt.SpotLight):
    @ti.func
    def share(self, theta):
        s = 0.0
        if self.falloff == self.cutoff:
            if theta < self.cutoff:
                s = 1.0
        else:
            s = tm.clamp((self.cutoff - theta) / (self.cutoff - self.falloff), 0.0, 1.0)
        return s

    @ti.func
    def sample(self, x, xi):
        way = x - tm.vec3(self.position)
        r = tm.length(way)
        axis = tm.vec3(self.target) - tm.vec3(self.position)
        cosine = ti.min(1.0, ti.max(-1.0, tm.dot(way, axis) / (r * axis.norm())))
        degrees = tm.acos(cosine) * 180 / tm.pi
        falls = self.attenuation[0] + self.attenuation[1] * r + self.attenuation[2] * r * r
        return -way / r, r, tm.vec3(self.intensity) * (self.share(degrees) / falls), 1.0


@ti.data_oriented
class AmbientLight(tt.AmbientLight):
    @ti.func
    def reflected(self, material):
        return material.Ka * tm.vec3(self.intensity)


@ti.data_oriented
class BlinnPhong(tt.BlinnPhong):
    @ti.func
    def highlight(self, surface, l):
        h = (surface.w_o + l) / tm.length(surface.w_o + l)
        result = 0.0
        if tm.dot(h, surface.normal) > 0:
            result = tm.dot(h, surface.normal) ** surface.material.Ns
        return result

    @ti.func
    def shade(self, scene, surface):
        color = tm.vec3(0.0)
        for i in ti.static(range(len(scene.lights.drawn))):
            l, distance, I, pdf = scene.lights.drawn[i].sample(surface.origin, tm.vec2(0.0))
            V = 1.0
            if tm.dot(surface.geometric_normal, l) <= 0 or scene.is_blocked(surface, l, distance):
                V = 0.0
            color += V * I * surface.material.Kd * ti.max(tm.dot(surface.normal, l), 0.0)
            color += V * I * surface.material.Ks * self.highlight(surface, l)
        return color + scene.lights.reflected_ambient(surface.material)

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        result, weight = tm.vec3(0.0), tm.vec3(1.0)
        is_eye_ray, left, goes_on = True, self.depth, True
        while goes_on:
            goes_on = False
            if not hit.is_hit:
                if is_eye_ray:
                    result = scene.behind(ray, hit, rng)
                else:
                    result += weight * scene.lights.from_far.radiance(ray, hit)
            elif not hit.is_backfacing:
                surface = scene.surface_at(ray, hit)
                result += weight * self.shade(scene, surface)
                if left > 0:
                    left -= 1
                    is_eye_ray = False
                    weight = weight * surface.material.Km
                    ray = surface.ray_along(tm.reflect(ray.direction, surface.normal))
                    hit = scene.met(surface, ray)
                    goes_on = True
        return result
