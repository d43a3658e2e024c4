"""What RT3's scene files can ask a picture for, beside light: the surface's own colour, its normal, its depth.

What a ray does not meet is the background's, see ``SceneInKernels.behind``.
"""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.surface_views import normal
from taichi_tracer.system import memory
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.registry import register


@ti.data_oriented
class RT3Integrator(Integrator):
    """A colour of what a ray met, before the background. A subclass says ``color``."""

    what, needs_light, samples_lights = "integrator", False, False

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """``color`` of a hit, else what lies behind the scene."""
        value = tm.vec3(0)
        if hit.is_hit:
            value = self.color(scene, ray, hit)
        else:
            value = scene.behind(ray, hit, rng)
        return value

    @ti.func
    def color(self, scene, ray, hit):
        """RGB of a hit."""
        ti.static_assert(False, "an integrator of RT3 must say what color(self, scene, ray, hit) is")
        return tm.vec3(0)


@register
@ti.data_oriented
class Flat(RT3Integrator):
    """The material's colour, whatever the light."""

    name, label, aliases = "flat", "Flat color", ("flat_color",)

    @ti.func
    def color(self, scene, ray, hit):
        """Kd."""
        return scene.material_library.get(hit.material_id).Kd


@register
@ti.data_oriented
class NormalMap(RT3Integrator):
    """The normal as a colour: the view ``normal``, before a background."""

    name, label, srgb = "normal_map", "Normal map", False

    @ti.func
    def color(self, scene, ray, hit):
        """(n + 1)/2."""
        return normal(hit)


@register
@ti.data_oriented
class DepthMap(RT3Integrator):
    """``near_color`` at depth ``zmin`` and before, ``far_color`` at ``zmax`` and beyond, linear between them.

    Depth is the distance along the camera's gaze: the t of a perspective ray whose direction is ŵ + u û + v v̂ (RT-5).

    Args:
        near_color, far_color: linear RGB.
        zmin, zmax: a bound that is None is where the scene's box begins or ends.
    """

    name, label, srgb = "depth_map", "Depth map", False
    # What the upper bound lies above the lower one at least, relative to it: a few steps of f32, so that the quotient
    # is finite where the scene is flat.
    LEAST_RANGE = 1e-6

    def __init__(self, near_color=(0, 0, 0), far_color=(1, 1, 1), zmin=None, zmax=None) -> None:
        if zmin is not None and zmax is not None and not zmin < zmax:
            raise InputError(f"depth_map: zmin must be less than zmax, not {zmin:g} and {zmax:g}")
        self.colors, self.zmin, self.zmax = (tuple(near_color), tuple(far_color)), zmin, zmax
        self._memory = None

    def facts(self) -> dict:
        """What the bits of a picture depend on, for checkpoints."""
        return {"depth map": [np.float32(self.colors).tolist(), self.zmin, self.zmax]}

    def prepare(self, scene_data, camera) -> None:
        """Bring gaze, colours and range into fields: called whenever a picture begins."""
        if self._memory is None or self._memory.is_over():
            self._memory = memory.Memory()
            self.depth_colors, self.gaze = ti.Vector.field(3, float), ti.Vector.field(3, float)
            self.depth_range = ti.Vector.field(2, float)
            self._memory.fields.dense(ti.i, 2).place(self.depth_colors)
            self._memory.fields.place(self.gaze, self.depth_range)
            self._memory.allocate()
        for i, color in enumerate(self.colors):
            self.depth_colors[i] = color
        matrix = camera.camera_to_world.to_numpy()
        self.gaze[None] = matrix[:3, 2]
        low, high = depth_of(scene_data.geometry, camera)
        zmin = low if self.zmin is None else self.zmin
        zmax = high if self.zmax is None else self.zmax
        least = math.nextafter(np.float32(zmin) * (1 + self.LEAST_RANGE), math.inf)
        self.depth_range[None] = zmin, max(zmax, least)

    @ti.func
    def color(self, scene, ray, hit):
        """near + s (far − near), s = (z − zmin)/(zmax − zmin)."""
        z = hit.distance * tm.dot(ray.direction, self.gaze[None])
        zmin, zmax = self.depth_range[None].x, self.depth_range[None].y
        s = tm.clamp((z - zmin) / (zmax - zmin), 0, 1)
        return self.depth_colors[0] + s * (self.depth_colors[1] - self.depth_colors[0])


def depth_of(geometry, camera) -> tuple[float, float]:
    """The least and the greatest depth of the corners of the scene's box, none of them behind the camera."""
    matrix = camera.compute_matrix()
    corners = np.stack(np.meshgrid(*zip(geometry.low, geometry.high, strict=True)), axis=-1).reshape(-1, 3)
    depth = (corners - matrix[:3, 3]) @ matrix[:3, 2]
    return max(float(depth.min()), 0.0), max(float(depth.max()), 0.0)
