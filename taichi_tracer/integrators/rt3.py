"""The integrators of RT3's scene files, except for light: the surface's own colour, texture coordinates, normal, depth.

A ray that hits nothing shows the background, see ``SceneInKernels.behind``.
"""

import math
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.base import Integrator, LiveNumbers
from taichi_tracer.integrators.surface_views import normal
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import register
from taichi_tracer.system.types import Numbers


@ti.data_oriented
class RT3Integrator(Integrator):
    """The colour of a hit, in front of the background. A subclass defines ``color``."""

    what, needs_light, samples_lights = "integrator", False, False

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        """``color`` of a hit; the background for a miss."""
        value = tm.vec3(0)
        if hit.is_hit:
            value = self.color(scene, ray, hit)
        else:
            value = scene.behind(ray, hit, rng)
        return value

    @ti.func
    def color(self, scene, ray, hit):
        """The RGB colour of a hit."""
        ti.static_assert(False, "an integrator of RT3 must say what color(self, scene, ray, hit) is")


@register
@ti.data_oriented
class Flat(RT3Integrator):
    """The material's colour, independent of light."""

    name, label, aliases = "flat", "Flat color", ("flat_color", "albedo")

    @ti.func
    def color(self, scene, ray, hit):
        """Kd, with its texture."""
        return scene.material_at(hit).Kd


@register
@ti.data_oriented
class TextureCoordinates(RT3Integrator):
    """Where the texture of a surface is looked up; black on surfaces of a scene without textures."""

    name, label, srgb = "uv", "Texture coordinates", False

    @ti.func
    def color(self, scene, ray, hit):
        """(u − ⌊u⌋, v − ⌊v⌋, 0)."""
        if ti.static(scene.effects.textures):
            uv = scene.textures.coordinates_at(hit)
            return tm.vec3(uv - ti.floor(uv), 0)
        return tm.vec3(0)


@register
@ti.data_oriented
class NormalMap(RT3Integrator):
    """The normal as a colour: the view ``normal``, in front of the background."""

    name, label, srgb = "normal_map", "Normal map", False

    @ti.func
    def color(self, scene, ray, hit):
        """(n + 1)/2."""
        return normal(hit)


@register
@ti.data_oriented
class DepthMap(RT3Integrator):
    """``near_color`` up to the depth ``zmin``, ``far_color`` from the depth ``zmax`` on, and linear in between.

    Depth is the distance along the camera's gaze. For a perspective ray with the direction ŵ + u û + v v̂, it is t
    (RT-5).

    Args:
        near_color, far_color: linear RGB.
        zmin, zmax: depths; None takes the depth at which the bounding box of the scene begins or ends.
    """

    name, label, srgb = "depth_map", "Depth map", False
    # The smallest distance of zmax above zmin, relative to zmin: a few steps of f32. It keeps the quotient finite if
    # the scene is flat.
    LEAST_RANGE = 1e-6

    def __init__(
        self,
        near_color: Numbers = (0, 0, 0),
        far_color: Numbers = (1, 1, 1),
        zmin: float | None = None,
        zmax: float | None = None,
    ) -> None:
        if zmin is not None and zmax is not None and not zmin < zmax:
            raise InputError(f"depth_map: zmin must be less than zmax, not {zmin:g} and {zmax:g}")
        self.near_color, self.far_color, self.zmin, self.zmax = tuple(near_color), tuple(far_color), zmin, zmax
        self.numbers = LiveNumbers()

    def arguments(self) -> dict[str, Any]:
        """What makes the same again."""
        return {"near_color": self.near_color, "far_color": self.far_color, "zmin": self.zmin, "zmax": self.zmax}

    def facts(self) -> dict:
        """Everything that the bits of a picture depend on, for checkpoints."""
        return {"depth map": [np.array([self.near_color, self.far_color], np.float32).tolist(), self.zmin, self.zmax]}

    def prepare(self, scene_data, camera) -> None:
        """Give colours, gaze and range to kernels; it is called whenever a picture begins."""
        low, high = depth_of(scene_data.geometry, camera)
        zmin = low if self.zmin is None else self.zmin
        zmax = high if self.zmax is None else self.zmax
        least = math.nextafter(np.float32(zmin) * (1 + self.LEAST_RANGE), math.inf)
        gaze = camera.camera_to_world.to_numpy()[:3, 2]
        self.numbers.set(*self.near_color, *self.far_color, *gaze.tolist(), zmin, max(zmax, least))

    @ti.func
    def color(self, scene, ray, hit):
        """near + s (far − near) with s = (z − zmin)/(zmax − zmin), clamped to [0, 1]."""
        z = hit.distance * tm.dot(ray.direction, self.three(6))
        zmin, zmax = self.numbers.get(9), self.numbers.get(10)
        s = tm.clamp((z - zmin) / (zmax - zmin), 0, 1)
        return self.three(0) + s * (self.three(3) - self.three(0))

    @ti.func
    def three(self, i: ti.template()):
        """Three of the numbers that ``prepare`` gives to kernels, from the i-th on."""
        return tm.vec3(self.numbers.get(i), self.numbers.get(i + 1), self.numbers.get(i + 2))


def depth_of(geometry, camera) -> tuple[float, float]:
    """The smallest and the largest depth of the corners of the scene's box; negative depths become 0."""
    matrix = camera.matrix()
    corners = np.stack(np.meshgrid(*zip(geometry.low, geometry.high, strict=True)), axis=-1).reshape(-1, 3)
    depth = (corners - matrix[:3, 3]) @ matrix[:3, 2]
    return max(float(depth.min()), 0.0), max(float(depth.max()), 0.0)
