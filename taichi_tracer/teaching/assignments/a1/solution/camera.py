"""Assignment 1, part 1: eye rays. A camera makes one ray for each pixel of the picture."""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Camera(tt.Camera):
    """A pinhole camera. The image plane stands one unit in front of the eye.

    In kernels, these attributes are known: ``self.width`` and ``self.height`` in pixels, ``self.eye``, ``self.at`` and
    ``self.up`` as vec3, ``self.fov`` (the vertical field of view in degrees), and ``self.camera_to_world[None]``, the
    matrix that ``compute_matrix`` returned when the camera moved last.
    """

    @ti.func
    def generate_ndc_coords(self, pixel_x, pixel_y):
        """The centre of a pixel in normalised device coordinates (vec2).

        The corners of the image are (±1, ±1). x grows to the right, y grows upwards, and pixel (0, 0) is at the bottom
        left. For a picture of w × h pixels:

            x_ndc = 2 (x + 0.5)/w − 1        y_ndc = 2 (y + 0.5)/h − 1
        """
        ndc_coords = tm.vec2(0)
        ### BEGIN SOLUTION
        ndc_coords.x = 2 * (pixel_x + 0.5) / self.width - 1
        ndc_coords.y = 2 * (pixel_y + 0.5) / self.height - 1
        ### END SOLUTION
        return ndc_coords

    @ti.func
    def generate_camera_coords(self, ndc_coords):
        """The direction of a point of the image plane in the camera's coordinates (vec4, with w = 0 for a direction).

            (x_ndc · tan(fov/2) · w/h,  y_ndc · tan(fov/2),  1,  0)

        ``fov`` is the whole vertical angle in degrees; ``ti.tan`` takes radians.
        """
        camera_coords = tm.vec4(0)
        ### BEGIN SOLUTION
        tan_half_fov = ti.tan(self.fov * tm.pi / 180 / 2)
        aspect = self.width / self.height
        camera_coords.x = ndc_coords.x * tan_half_fov * aspect
        camera_coords.y = ndc_coords.y * tan_half_fov
        camera_coords.z = 1
        ### END SOLUTION
        return camera_coords

    def compute_matrix(self):
        """The matrix from the camera's coordinates to the world: a numpy array of shape (4, 4).

        Python calls this method whenever the camera moves, so that numpy can be used here. With × for the cross product
        and all axes of unit length:

            z_c = normalize(at − eye)      x_c = normalize(up × z_c)      y_c = z_c × x_c

            [ x_c  y_c  z_c  eye ]         the axes and the eye are columns
            [  0    0    0    1  ]
        """
        matrix = np.eye(4)
        ### BEGIN SOLUTION
        z_c = (self.at - self.eye) / np.linalg.norm(self.at - self.eye)
        side = np.cross(self.up, z_c)
        x_c = side / np.linalg.norm(side)
        y_c = np.cross(z_c, x_c)
        matrix[:3, 0] = x_c
        matrix[:3, 1] = y_c
        matrix[:3, 2] = z_c
        matrix[:3, 3] = self.eye
        ### END SOLUTION
        return matrix

    @ti.func
    def generate_ray(self, pixel_x, pixel_y):
        """The eye ray of a pixel (``tt.Ray``): from the eye, through the centre of the pixel, with a unit direction.

        Call ``self.generate_ndc_coords`` first and ``self.generate_camera_coords`` second. Then transform the direction
        by the matrix ``self.camera_to_world[None]`` (@ multiplies a matrix and a vector), and normalise it.
        """
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0, 0, 1))
        ### BEGIN SOLUTION
        ndc_coords = self.generate_ndc_coords(pixel_x, pixel_y)
        camera_coords = self.generate_camera_coords(ndc_coords)
        world_coords = self.camera_to_world[None] @ camera_coords
        ray.origin = self.eye
        ray.direction = tm.normalize(world_coords.xyz)
        ### END SOLUTION
        return ray
