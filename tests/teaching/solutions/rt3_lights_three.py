"""Assignment rt3_lights as student three writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class PointLight(tt.PointLight):
    @ti.func
    def sample(self, x, xi):
        offset = tm.vec3(self.position) - x
        squared = offset.norm_sqr()
        r = ti.sqrt(squared)
        return offset.normalized(), r, tm.vec3(self.intensity) / self.falls(r, squared), 1.0

    @ti.func
    def falls(self, r, squared):
        k = tm.vec3(self.attenuation)
        return k[0] + k[1] * r + k[2] * squared


@ti.data_oriented
class DirectionalLight(tt.DirectionalLight):
    @ti.func
    def sample(self, x, xi):
        w_i = tm.vec3(self.direction).normalized() * -1.0
        distance = tm.inf
        return w_i, distance, 1.0 * tm.vec3(self.irradiance), 1.0


@ti.data_oriented
class SpotLight(tt.SpotLight):
    @ti.func
    def share(self, theta):
        width = self.cutoff - self.falloff
        s = ti.select(theta < self.cutoff, 1.0, 0.0)
        if width > 0:
            s = ti.max(0.0, ti.min(1.0, (self.cutoff - theta) / width))
        return s

    @ti.func
    def sample(self, x, xi):
        p = tm.vec3(self.position)
        r = (p - x).norm()
        w_i = (p - x) / r
        axis = (tm.vec3(self.target) - p).normalized()
        cosine = -tm.dot(w_i, axis)
        theta = 0.0
        if cosine <= -1:
            theta = 180.0
        elif cosine < 1:
            theta = tm.degrees(ti.acos(cosine))
        k = tm.vec3(self.attenuation)
        return w_i, r, tm.vec3(self.intensity) / (k.x + k.y * r + k.z * r * r) * self.share(theta), 1.0


@ti.data_oriented
class AmbientLight(tt.AmbientLight):
    @ti.func
    def reflected(self, material):
        shown = tm.vec3(0.0)
        for i in ti.static(range(3)):
            shown[i] = self.intensity[i] * material.Ka[i]
        return shown


@ti.data_oriented
class BlinnPhong(tt.BlinnPhong):
    @ti.func
    def highlight(self, surface, l):
        between = surface.w_o + l
        cosine = tm.dot(surface.normal, between) / between.norm()
        return ti.select(cosine > 0, ti.exp(surface.material.Ns * ti.log(ti.max(cosine, 1e-30))), 0.0)

    @ti.func
    def shade(self, scene, surface):
        m, L = surface.material, tm.vec3(0.0)
        for k in range(ti.static(len(scene.lights.drawn))):
            l, distance, I, pdf = scene.lights.sample_drawn(k, surface.origin, tm.vec2(0.5))
            if tm.dot(surface.geometric_normal, l) > 0:
                reflected = m.Kd * ti.max(0.0, tm.dot(surface.normal, l)) + m.Ks * self.highlight(surface, l)
                if not scene.is_blocked(surface, l, distance):
                    L += reflected * I
        L += scene.lights.reflected_ambient(m)
        return L

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        L, k, mirrors = tm.vec3(0.0), tm.vec3(1.0), 0
        is_front = hit.is_hit and not hit.is_backfacing
        if not hit.is_hit:
            L += scene.behind(ray, hit, rng)
        while is_front:
            surface = scene.surface_at(ray, hit)
            L += k * self.shade(scene, surface)
            k = k * surface.material.Km
            is_front = False
            if mirrors < self.depth:
                mirrors += 1
                along = tm.dot(surface.normal, ray.direction) * surface.normal
                ray = surface.ray_along(ray.direction - 2 * along)
                hit = scene.met(surface, ray)
                is_front = hit.is_hit and not hit.is_backfacing
                if not hit.is_hit:
                    L += k * scene.lights.from_far.radiance(ray, hit)
        return L
