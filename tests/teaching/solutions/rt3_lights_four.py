"""Assignment rt3_lights as student four writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class SpotLight(tt.SpotLight):
    @ti.func
    def share(self, theta):
        s = 0.0
        if theta < self.cutoff:
            s = 1.0
            if theta > self.falloff:
                s = (theta - self.cutoff) / (self.falloff - self.cutoff)
        return s


@ti.data_oriented
class BlinnPhong(tt.BlinnPhong):
    @ti.func
    def highlight(self, surface, l):
        v, n = surface.w_o, surface.normal
        squared = ti.max(2 + 2 * tm.dot(v, l), 1e-12)
        return ti.pow(ti.max(0.0, tm.dot(n, v) + tm.dot(n, l)) / ti.sqrt(squared), surface.material.Ns)

    @ti.func
    def shade(self, scene, surface):
        L, material = scene.lights.reflected_ambient(surface.material), surface.material
        for light in ti.static(scene.lights.drawn):
            l, distance, I, pdf = light.sample(surface.origin, tm.vec2(0.5))
            if surface.lets_pass(l):
                blocker = scene.ray_intersector.query_ray(surface.ray_along(l))
                if not (blocker.is_hit and blocker.distance < distance):
                    L += I * material.Ks * self.highlight(surface, l)
                    L += I * material.Kd * tm.clamp(tm.dot(l, surface.normal), 0.0, 1.0)
        return L
