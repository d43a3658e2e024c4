"""A light at a point: it shines equally to all sides, and no ray meets it by chance."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Bulb(tt.Light):
    """Radiant intensity I, in watt per steradian, at a position: at a distance r it gives the irradiance I cos θ / r².

    Args:
        position: three numbers, in world space.
        intensity: three numbers, linear RGB.
    """

    name, is_delta = "bulb", True

    def __init__(self, position=(0.3, 1.5, 0.4), intensity=(2.0, 1.5, 1.0)):
        self.position, self.intensity = position, intensity

    @ti.func
    def sample(self, x, xi):
        """(w_i, distance, radiance, pdf): the direction to the point; as for every delta light, the pdf is 1."""
        to_light = tm.vec3(self.position) - x
        distance = to_light.norm()
        return to_light / distance, distance, tm.vec3(self.intensity) / distance**2, 1.0
