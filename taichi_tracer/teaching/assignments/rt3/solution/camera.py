"""RT3, phase 2: a perspective and an orthographic camera.

In kernels, ``self.width`` and ``self.height`` are the numbers of columns and rows. ``self.edges()`` gives the screen
window l, r, b, t. ``self.frame()`` gives the eye e and the axes û, v̂ and ŵ, which ``compute_matrix`` made.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Window:
    """Given: what both cameras ask for in kernels."""

    @ti.func
    def edges(self):
        """l, r, b and t of the screen window."""
        half, centre = self.half_size[None], self.centre[None]
        return centre.x - half.x, centre.x + half.x, centre.y - half.y, centre.y + half.y

    @ti.func
    def frame(self):
        """e, û, v̂ and ŵ, the columns of the matrix in another order."""
        m = self.camera_to_world[None]
        e = tm.vec3(m[0, 3], m[1, 3], m[2, 3])
        u = tm.vec3(m[0, 0], m[1, 0], m[2, 0])
        v = tm.vec3(m[0, 1], m[1, 1], m[2, 1])
        w = tm.vec3(m[0, 2], m[1, 2], m[2, 2])
        return e, u, v, w


@ti.data_oriented
class PerspectiveCamera(Window, tt.Camera):
    """Rays from the eye through every pixel of a window at the distance 1."""

    def compute_matrix(self):
        """The frame of the camera (left-handed), as a numpy array of shape (4, 4) with the columns û, v̂, ŵ and e.

            gaze = look_at − look_from     ŵ = normalize(gaze)
            û = normalize(vup × ŵ)         v̂ = normalize(ŵ × û)         e = look_from

        Python calls this method. look_from is ``self.eye``, look_at ``self.at``, and vup ``self.up``.
        """
        matrix = np.eye(4)
        ### BEGIN SOLUTION
        gaze = self.at - self.eye
        w = gaze / np.linalg.norm(gaze)
        u = np.cross(self.up, w)
        u = u / np.linalg.norm(u)
        v = np.cross(w, u)
        v = v / np.linalg.norm(v)
        matrix[:3, 0] = u
        matrix[:3, 1] = v
        matrix[:3, 2] = w
        matrix[:3, 3] = self.eye
        ### END SOLUTION
        return matrix

    @ti.func
    def pixel_to_screen(self, i, j):
        """The point (u, v) of the screen window (vec2) at the centre of pixel (i, j); (0, 0) is at the bottom left.

            u = l + (r − l) (i + 0.5)/n_x        v = b + (t − b) (j + 0.5)/n_y

        i and j may be fractions of a pixel.
        """
        point = tm.vec2(0)
        ### BEGIN SOLUTION
        l, r, b, t = self.edges()
        point.x = l + (r - l) * (i + 0.5) / self.width
        point.y = b + (t - b) * (j + 0.5) / self.height
        ### END SOLUTION
        return point

    @ti.func
    def generate_ray(self, i, j):
        """The ray of a pixel (``tt.Ray``): origin e, and the direction ŵ + u û + v v̂, normalised."""
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0, 0, 1))
        ### BEGIN SOLUTION
        point = self.pixel_to_screen(i, j)
        e, u, v, w = self.frame()
        ray.origin = e
        ray.direction = tm.normalize(w + point.x * u + point.y * v)
        ### END SOLUTION
        return ray


@ti.data_oriented
class OrthographicCamera(Window, tt.OrthographicCamera):
    """Parallel rays from every pixel of the window."""

    @ti.func
    def generate_ray(self, i, j):
        """The ray of a pixel (``tt.Ray``): origin e + u û + v v̂, and the direction ŵ.

        u = l + (r − l) (i + 0.5)/n_x        v = b + (t − b) (j + 0.5)/n_y
        """
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0, 0, 1))
        ### BEGIN SOLUTION
        l, r, b, t = self.edges()
        x = l + (r - l) * (i + 0.5) / self.width
        y = b + (t - b) * (j + 0.5) / self.height
        e, u, v, w = self.frame()
        ray.origin = e + x * u + y * v
        ray.direction = w
        ### END SOLUTION
        return ray
