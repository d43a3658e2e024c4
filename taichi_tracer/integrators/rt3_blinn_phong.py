"""The sum of Blinn and Phong, with shadows and mirrors: RT3's integrator for light (RT-11).

    L = I_a k_a + Σ I_i (k_d max(0, n·l) + k_s max(0, n·h)^g) V_i + k_m L(mirrored),   h = normalize(v + l)

k_a, k_d, k_s, k_m and g are Ka, Kd, Ks, Km and Ns of the material. I_i is what arrives from the light i at the surface,
and V_i is 0 where something stands between them. The sum is not physical: k_d is not divided by π, and nothing bounds
what is reflected. Environments and surfaces that emit do not light anything; they are only seen.
"""

from typing import TYPE_CHECKING

import taichi as ti

from taichi_tracer.brdfs.phong import log1p_of_negative
from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.frames import mirrored
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import varying
from taichi_tracer.system.parts import overridable, register

if TYPE_CHECKING:
    from taichi_tracer.scene_data import SceneData

MOST_MIRRORS = 64  # as many as surfaces of a path may reflect


@register
@ti.data_oriented
@overridable(radiance="vec3", shade="vec3", highlight="number")
class BlinnPhong(Integrator):
    """The sum at the first surface, and at those that it mirrors. The backs of surfaces are black.

    Args:
        depth: how many mirrors one after the other are followed, from 0 to 64.
    """

    name, label, what, needs_light, samples_lights = "blinn_phong", "Blinn-Phong", "integrator", False, False

    def __init__(self, depth: int = 5) -> None:
        if not (isinstance(depth, int) and 0 <= depth <= MOST_MIRRORS):
            raise InputError(f"blinn_phong: depth must be a whole number from 0 to {MOST_MIRRORS}, not {depth!r}")
        self.depth, self._is_dark = varying(depth), False

    def prepare(self, scene_data: "SceneData", camera: ProjectiveCamera) -> None:
        """See whether the scene has lights that count here."""
        self._is_dark = not scene_data.lights

    def notes(self) -> list[str]:
        """That nothing is lit."""
        if not self._is_dark:
            return []
        return ["blinn_phong counts ambient, directional, point and spot lights, and the scene has none: all is black"]

    def facts(self) -> dict:
        """Everything that the bits of a picture depend on, for checkpoints."""
        return {"mirrors": int(self.depth)}

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """The sum of the surface that the ray hit, and k_m times that of what it mirrors; the background for a miss."""
        L, k, mirrors, is_going = tm.vec3(0), tm.vec3(1), 0, hit.is_hit
        if not hit.is_hit:
            L = scene.behind(ray, hit, rng)
        while is_going:
            is_going = False
            if not hit.is_backfacing:
                surface = scene.surface_at(ray, hit)
                L += k * self.shade(scene, surface)
                k *= surface.material.Km
                ray = surface.ray_along(mirrored(surface.w_o, surface.normal))
                if tm.component_max(k) > 0 and mirrors < self.depth and surface.lets_pass(ray.direction):
                    mirrors += 1
                    hit = scene.met(surface, ray)
                    is_going = hit.is_hit
                    if not hit.is_hit:
                        L += k * scene.lights.from_far.radiance(ray, hit)
        return L

    @ti.func
    def shade(self, scene, surface):
        """I_a k_a + Σ I_i (k_d max(0, n·l) + k_s max(0, n·h)^g) V_i."""
        material, n = surface.material, surface.normal
        L = scene.lights.reflected_ambient(material)
        for i in range(ti.static(len(scene.lights.drawn))):
            l, distance, I, pdf = scene.lights.sample_drawn(i, surface.origin, tm.vec2(0.5))
            reflected = material.Kd * ti.max(0.0, tm.dot(n, l)) + material.Ks * self.highlight(surface, l)
            I *= reflected / pdf
            if tm.component_max(I) > 0 and tm.dot(surface.geometric_normal, l) > 0:
                if not scene.is_blocked(surface, l, distance):
                    L += I
        return L

    @ti.func
    def highlight(self, surface, l):
        """max(0, n·h)^g, as (1 − |n × h|²)^(g/2): for a large g, n·h would be rounded too coarsely."""
        h = tm.normalize(surface.w_o + l)
        sine_squared = tm.cross(surface.normal, h).norm_sqr()
        value = 0.0
        if tm.dot(surface.normal, h) > 0 and sine_squared < 1:
            value = ti.exp(surface.material.Ns / 2 * log1p_of_negative(sine_squared))
        return value
