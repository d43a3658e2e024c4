"""Assignment rt3 as student four writes it."""

import numpy as np
import taichi as ti
import taichi.math as tm
from camera import Window

import taichi_tracer as tt


@ti.data_oriented
class PerspectiveCamera(Window, tt.Camera):
    def compute_matrix(self):
        eye, at, up = (np.array(vector, dtype=np.float32) for vector in (self.eye, self.at, self.up))
        w = (at - eye) / np.linalg.norm(at - eye)
        u = np.cross(up, w)
        u /= np.linalg.norm(u)
        v = np.cross(w, u)
        m = np.identity(4, dtype=np.float32)
        for row in range(3):
            m[row, 0], m[row, 1], m[row, 2], m[row, 3] = u[row], v[row], w[row], eye[row]
        return m

    @ti.func
    def pixel_to_screen(self, i, j):
        half, centre = self.half_size[None], self.centre[None]
        size = tm.vec2(self.width, self.height)
        return centre + half * ((2 * tm.vec2(i, j) + 1) / size - 1)

    @ti.func
    def generate_ray(self, i, j):
        e, u, v, w = self.frame()
        l, r, b, t = self.edges()
        x = l + (r - l) * (i + 0.5) / self.width
        y = b + (t - b) * (j + 0.5) / self.height
        point = e + w + x * u + y * v
        return tt.Ray(e, (point - e).normalized())


@ti.data_oriented
class OrthographicCamera(Window, tt.OrthographicCamera):
    @ti.func
    def generate_ray(self, i, j):
        corner, across, upwards, w = self.window()
        origin = corner + (i + 0.5) * across + (j + 0.5) * upwards
        return tt.Ray(origin=origin, direction=w)

    @ti.func
    def window(self):
        l, r, b, t = self.edges()
        e, u, v, w = self.frame()
        return e + l * u + b * v, (r - l) / self.width * u, (t - b) / self.height * v, w
