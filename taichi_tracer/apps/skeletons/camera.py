"""A camera: from a pixel to a ray."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Mine(tt.Camera):
    """A fisheye: the distance from the middle of the picture is the angle from the gaze.

    Pixels count from 0 at the bottom left, and may be fractions. ``generate_ndc_coords`` maps the window to [−1, 1]².
    The camera's own frame is x to the side, y up, z forward; ``camera_to_world[None]`` is its 4 × 4 matrix.
    """

    name = "mine"

    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        """The tt.Ray of a pixel, in world space; its direction has unit length. ``fov`` is in degrees."""
        ndc = self.generate_ndc_coords(pixel_x, pixel_y)
        on_plane = tm.vec2(ndc.x * self.width / self.height, ndc.y)
        radius = on_plane.norm()
        theta = radius * tm.radians(self.fov) / 2
        side = ti.select(radius > 0, on_plane / radius, 0.0)
        in_camera = tm.vec4(ti.sin(theta) * side, ti.cos(theta), 0)
        return tt.Ray(origin=self.eye, direction=tm.normalize((self.camera_to_world[None] @ in_camera).xyz))
