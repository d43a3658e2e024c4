"""An equidistant fisheye: the distance from the middle of the picture tells the angle from the gaze."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Fisheye(tt.Camera):
    """As the pinhole camera, but a pixel stands for an angle instead of a point of a plane: fov may be 180 and more."""

    name = "fisheye"

    @classmethod
    def check_fov(cls, fov, screen_window):
        """Any angle up to a full turn."""
        if fov is not None and not 0 < float(fov) <= 360:
            raise tt.InputError(f"fisheye: fov must be above 0 and at most 360 degrees, not {fov:g}")
        return fov

    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        """The eye ray of a pixel: θ = fov/2 at the upper edge, and in proportion everywhere else."""
        ndc = self.generate_ndc_coords(pixel_x, pixel_y)
        on_plane = tm.vec2(ndc.x * self.width / self.height, ndc.y)
        radius = on_plane.norm()
        theta = radius * tm.radians(self.fov) / 2
        across = ti.select(radius > 0, on_plane / radius, 0.0)
        in_camera = tm.vec4(ti.sin(theta) * across, ti.cos(theta), 0)
        return tt.Ray(origin=self.eye, direction=tm.normalize((self.camera_to_world[None] @ in_camera).xyz))
