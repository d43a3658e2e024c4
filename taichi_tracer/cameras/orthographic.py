"""The orthographic camera: parallel rays along the gaze (RT-5)."""

import taichi as ti

from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.ray import Ray
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import overridable, register
from taichi_tracer.system.types import Numbers


@register
@ti.data_oriented
@overridable("ray_through")
class OrthographicCamera(ProjectiveCamera):
    """Parallel rays along the gaze, from every point of a window around the eye (RT-5).

    Objects that are far away do not look smaller. Arguments as for ``CameraSettings``, with lengths in world units.
    There is no ``fov``, and the focal distance has no effect.
    """

    name, is_parallel = "orthographic", True

    @ti.func
    def ray_through(self, ndc):
        """The ray from e + u û + v v̂ along ŵ."""
        p, m = self.generate_camera_coords(ndc), self.camera_to_world[None]
        x, y = p.x, p.y
        origin = tm.vec3(0)
        for k in ti.static(range(3)):
            origin[k] = m[k, 0] * x + m[k, 1] * y + m[k, 3]
        return Ray(origin=origin, direction=tm.vec3(m[0, 2], m[1, 2], m[2, 2]))

    @classmethod
    def check_fov(cls, fov: float | None, screen_window: Numbers | None) -> float | None:
        """None, because there is no angle between parallel rays."""
        if fov is not None:
            raise InputError(f"camera: an orthographic camera has no fov ({fov}): give it a screen_window")
        return None
