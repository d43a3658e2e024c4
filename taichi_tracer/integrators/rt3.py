"""What RT3's scene files can ask a picture for, beside light: the surface's own colour, its normal, its depth.

An integrator is a class with a ``name`` and a ``color`` of what a ray met; what it did not meet is the background's.
One added to ``ALL`` is known to ``RT3Renderer``, the scene files, the command line, the window and the tests.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.integrators import surface_views


class Flat:
    """The material's colour, whatever the light."""

    name, label, aliases = "flat", "Flat color", ("flat_color",)
    srgb = True

    @ti.func
    def color(self, renderer: ti.template(), ray, data):
        """Kd."""
        return renderer.scene_data.material_library.get(data.material_id).Kd


class NormalMap:
    """The normal as a colour: the view ``normal``, before a background."""

    name, label, aliases = "normal_map", "Normal map", ()
    srgb = False

    @ti.func
    def color(self, renderer: ti.template(), ray, data):
        """(n + 1)/2."""
        return surface_views.normal(data)


class DepthMap:
    """``near_color`` at depth ``zmin`` and before, ``far_color`` at ``zmax`` and beyond, linear between them.

    Depth is the distance along the camera's gaze: the t of a perspective ray whose direction is ŵ + u û + v v̂ (RT-5).
    """

    name, label, aliases = "depth_map", "Depth map", ()
    srgb = False

    @ti.func
    def color(self, renderer: ti.template(), ray, data):
        """near + s (far − near), s = (z − zmin)/(zmax − zmin)."""
        m = renderer.camera.camera_to_world[None]
        z = data.distance * tm.dot(ray.direction, tm.vec3(m[0, 2], m[1, 2], m[2, 2]))
        zmin, zmax = renderer.depth_range[None].x, renderer.depth_range[None].y
        s = tm.clamp((z - zmin) / (zmax - zmin), 0, 1)
        return renderer.depth_colors[0] + s * (renderer.depth_colors[1] - renderer.depth_colors[0])


ALL = (Flat(), NormalMap(), DepthMap())
