"""Assignment rt3_lights as student two writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class PointLight(tt.PointLight):
    @ti.func
    def sample(self, x, xi):
        position, attenuation = tm.vec3(self.position), tm.vec3(self.attenuation)
        distance = tm.distance(position, x)
        w_i = (position - x) * (1.0 / distance)
        powers = tm.vec3(1.0, distance, distance * distance)
        return w_i, distance, tm.vec3(self.intensity) / tm.dot(attenuation, powers), 1.0


@ti.data_oriented
class DirectionalLight(tt.DirectionalLight):
    @ti.func
    def sample(self, x, xi):
        d = tm.vec3(self.direction)
        length = ti.sqrt(tm.dot(d, d))
        w_i = tm.vec3(-d.x / length, -d.y / length, -d.z / length)
        return w_i, tm.inf, tm.vec3(self.irradiance), 1.0


@ti.data_oriented
class SpotLight(tt.SpotLight):
    @ti.func
    def share(self, theta):
        s = 1.0
        if theta > self.falloff:
            s = 1 - (theta - self.falloff) / ti.max(self.cutoff - self.falloff, 1e-6)
            if theta >= self.cutoff:
                s = 0.0
        return s

    @ti.func
    def sample(self, x, xi):
        position = tm.vec3(self.position)
        axis = tm.normalize(tm.vec3(self.target) - position)
        out = tm.normalize(x - position)
        r = tm.distance(x, position)
        theta = tm.atan2(tm.cross(axis, out).norm(), tm.dot(axis, out)) / tm.pi * 180.0
        powers = tm.vec3(1.0, r, r * r)
        light = tm.vec3(self.intensity) / tm.dot(tm.vec3(self.attenuation), powers)
        return -out, r, light * self.share(theta), 1.0


@ti.data_oriented
class AmbientLight(tt.AmbientLight):
    @ti.func
    def reflected(self, material):
        I, Ka = tm.vec3(self.intensity), material.Ka
        return tm.vec3(I.x * Ka.x, I.y * Ka.y, I.z * Ka.z)


@ti.data_oriented
class BlinnPhong(tt.BlinnPhong):
    @ti.func
    def highlight(self, surface, l):
        h = tm.normalize(0.5 * (surface.w_o + l))
        return ti.pow(tm.clamp(tm.dot(h, surface.normal), 0.0, 1.0), surface.material.Ns)

    @ti.func
    def shade(self, scene, surface):
        total = scene.lights.reflected_ambient(surface.material)
        for light in ti.static(scene.lights.drawn):
            total += self.of_one_light(scene, surface, light)
        return total

    @ti.func
    def of_one_light(self, scene, surface, light: ti.template()):
        found = tm.vec3(0.0)
        sample = light.sample(surface.origin, tm.vec2(0.5, 0.5))
        l = sample[0]
        if tm.dot(l, surface.geometric_normal) > 0:
            if not scene.is_blocked(surface, l, sample[1]):
                found += surface.material.Kd * ti.max(0.0, tm.dot(l, surface.normal)) * sample[2]
                found += surface.material.Ks * self.highlight(surface, l) * sample[2]
        return found

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        L, k = tm.vec3(0.0), tm.vec3(1.0)
        is_seen = True
        for i in range(self.depth + 1):
            if is_seen and hit.is_hit:
                is_seen = not hit.is_backfacing
                if is_seen:
                    surface = scene.surface_at(ray, hit)
                    L += k * self.shade(scene, surface)
                    k *= surface.material.Km
                    n, v = surface.normal, surface.w_o
                    ray = surface.ray_along(2 * n * tm.dot(n, v) - v)
                    if i < self.depth:
                        hit = scene.met(surface, ray)
                        if not hit.is_hit:
                            L += k * scene.lights.from_far.radiance(ray, hit)
            elif is_seen and i == 0:
                L = scene.behind(ray, hit, rng)
        return L
