"""How far away is it? Near is black, then red, yellow, and white from 5 units on, as glowing iron."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt

HOTTEST = 5.0  # the distance, in units of the scene, that is shown as white


@tt.register
class HeatMap(tt.View):
    """Each third of the distance fills one of the three colours."""

    name, label = "heat_map", "Heat map"

    @ti.func
    def color(self, hit):
        """RGB in [0, 1] of what the ray hit."""
        heat = 3 * hit.distance / HOTTEST
        return tm.clamp(tm.vec3(heat, heat - 1, heat - 2), 0, 1)
