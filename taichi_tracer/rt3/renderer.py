"""RT3's pictures: what a ray met, before the background of the scene file (RT-7), as one of three integrators."""

import math

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators.direct_light import Lighting
from taichi_tracer.integrators import rt3 as integrators
from taichi_tracer.renderer import A2Renderer, ProgressiveRenderer
from taichi_tracer.rt3.document import Shot
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError


@ti.data_oriented
class RT3Renderer(ProgressiveRenderer):
    """A picture of a scene by one of ``integrators.ALL``. Arguments as for ``ProgressiveRenderer``."""

    offers = integrators.ALL
    what = "integrator"
    setter = "set_integrator_"

    def __init__(self, scene_data, *arguments, **options) -> None:
        super().__init__(scene_data, *arguments, **options)
        self._memory = runtime.Memory()
        self.depth_colors = ti.Vector.field(3, float)
        self.depth_range = ti.Vector.field(2, float)
        self._memory.fields.dense(ti.i, 2).place(self.depth_colors)
        self._memory.fields.place(self.depth_range)
        self._memory.allocate()
        self._depth_version, self._lit = 0, None
        self.set_depth()

    @property
    def srgb(self) -> bool:
        """Whether the picture is of colours, to be written with the sRGB transfer function (C-14)."""
        return self.active.srgb

    def set_depth(self, near_color=(0, 0, 0), far_color=(1, 1, 1), zmin=None, zmax=None) -> None:
        """Colours and range of the depth map; a bound that is None is where the scene's box begins or ends."""
        if zmin is not None and zmax is not None and not zmin < zmax:
            raise InputError(f"depth_map: zmin must be less than zmax, not {zmin:g} and {zmax:g}")
        self._zmin, self._zmax = zmin, zmax
        for i, color in enumerate((near_color, far_color)):
            self.depth_colors[i] = tuple(color)
        self._depth_version += 1

    def state(self) -> tuple:
        """What the picture depends on, the colours and range of the depth map among it."""
        return *super().state(), self._depth_version

    def facts(self) -> dict:
        """What the bits of a picture depend on, the colours and range of the depth map among it."""
        return {**super().facts(), "depth map": [self.depth_colors.to_numpy().tolist(), self._zmin, self._zmax]}

    def begin(self) -> None:
        """Start over; the range of the depth map follows the camera."""
        super().begin()
        low, high = self._depth_of_scene()
        zmin = low if self._zmin is None else self._zmin
        zmax = high if self._zmax is None else self._zmax
        self.depth_range[None] = zmin, max(zmax, math.nextafter(np.float32(zmin) * 1.000001, math.inf))

    def _depth_of_scene(self) -> tuple[float, float]:
        """The least and the greatest depth of the corners of the scene's box, none of them behind the camera."""
        geometry, matrix = self.scene_data.geometry, self.camera.compute_matrix()
        corners = np.stack(np.meshgrid(*zip(geometry.low, geometry.high, strict=True)), axis=-1).reshape(-1, 3)
        depth = (corners - matrix[:3, 3]) @ matrix[:3, 2]
        return max(float(depth.min()), 0.0), max(float(depth.max()), 0.0)

    def add_sample(self, index: int) -> None:
        """Without jitter, every sample is the picture itself."""
        if self._lit != self.scene_data.version:
            self._lighting, self._lit = Lighting(self.scene_data, self.sampler), self.scene_data.version
        self.trace_primary_hits(index)
        self._shade(self._lighting, self.active, index)

    @ti.kernel
    def _shade(self, lighting: ti.template(), integrator: ti.template(), index: ti.u32):
        for x, y in ti.ndrange(*self.film.ranges):
            ray = self.hits.eye_ray(x, y)
            data = self.hits.hit_data(x, y, ray)
            value = tm.vec3(0)
            if data.is_hit:
                value = integrator.color(self, ray, data)
            else:
                value = lighting.behind(ray.direction, x, y, self.width, self.height)
            self.record(x, y, value, index)


def renderer_of(scene_data, shot: Shot | None = None, **options) -> ProgressiveRenderer:
    """The renderer that a scene file asks for: with its camera, its film's size and crop, and its integrator.

    Args:
        scene_data: a scene that was read from the file.
        shot: which of its pictures; the first when None.
        options: as for ``ProgressiveRenderer``, instead of what the file says.
    """
    shot = scene_data.shots[0] if shot is None else shot
    film = shot.film
    if "camera" not in options:
        from taichi_tracer.camera import make_camera

        size = options.pop("width", film.width), options.pop("height", film.height)
        options["camera"] = make_camera(*size, **shot.view)
    camera = options["camera"]
    options.setdefault("crop", film.crop(camera.width, camera.height))
    if shot.integrator.name == "direct":
        return A2Renderer(scene_data, **options).use(shot.integrator.estimator)
    renderer = RT3Renderer(scene_data, **options).use(shot.integrator.name)
    if shot.integrator.depth:
        renderer.set_depth(**shot.integrator.depth)
    return renderer
