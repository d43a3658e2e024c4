"""Assignment 2, part 1: eye rays through a random point of each pixel, so that edges become smooth."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Camera(tt.Camera):
    """The camera of assignment 1, with jitter."""

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y, jitter=False):
        """A point of a pixel in normalised device coordinates (vec2).

        Without jitter, it is the centre of the pixel, as in assignment 1. With jitter, it is a random point, uniform on
        the area of the pixel: draw two random numbers ξ in [0, 1) by ``ti.random()``, and take them in place of 0.5:

            x_ndc = 2 (x + ξ1)/w − 1        y_ndc = 2 (y + ξ2)/h − 1
        """
        ndc_coords = tm.vec2(0)
        ### BEGIN SOLUTION
        within = tm.vec2(0.5)
        if jitter:
            within = tm.vec2(ti.random(), ti.random())
        ndc_coords.x = 2 * (pixel_x + within.x) / self.width - 1
        ndc_coords.y = 2 * (pixel_y + within.y) / self.height - 1
        ### END SOLUTION
        return ndc_coords

    @ti.func
    def generate_ray(self, pixel_x, pixel_y, jitter=False):
        """The eye ray of a pixel, as in assignment 1; with jitter, through a random point of the pixel."""
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0, 0, 1))
        ### BEGIN SOLUTION
        ndc_coords = self.generate_ndc_coords(pixel_x, pixel_y, jitter)
        world_coords = self.camera_to_world[None] @ self.generate_camera_coords(ndc_coords)
        ray.origin = self.eye
        ray.direction = tm.normalize(world_coords.xyz)
        ### END SOLUTION
        return ray
