"""Assignment rt3_lights as student five writes it."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class PointLight(tt.PointLight):
    @ti.func
    def sample(self, x, xi):
        x_l, y_l, z_l = self.position[0], self.position[1], self.position[2]
        r = ti.sqrt((x_l - x.x) ** 2 + (y_l - x.y) ** 2 + (z_l - x.z) ** 2)
        w_i = tm.vec3((x_l - x.x) / r, (y_l - x.y) / r, (z_l - x.z) / r)
        divisor = self.attenuation[0] + self.attenuation[1] * r + self.attenuation[2] * r**2
        light = tm.vec3(self.intensity[0], self.intensity[1], self.intensity[2]) / divisor
        return w_i, r, light, 1.0


@ti.data_oriented
class BlinnPhong(tt.BlinnPhong):
    @ti.func
    def shade(self, scene, surface):
        Kd, Ks, n = surface.material.Kd, surface.material.Ks, surface.normal
        L = tm.vec3(0.0)
        for one in ti.static(scene.lights.ambient):
            L += one.reflected(surface.material)
        for one in ti.static(scene.lights.drawn):
            l, r, I, p = one.sample(surface.origin, tm.vec2(0.5))
            is_lit = tm.dot(surface.geometric_normal, l) > 0
            if is_lit:
                is_lit = not scene.is_blocked(surface, l, r)
            L += ti.select(is_lit, I * (Kd * ti.max(0.0, tm.dot(n, l)) + Ks * self.highlight(surface, l)), tm.vec3(0.0))
        return L
