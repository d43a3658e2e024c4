"""Assignment rt3 as student five writes it."""

import numpy as np
import taichi as ti
import taichi.math as tm
from camera import Window

import taichi_tracer as tt


@ti.data_oriented
class PerspectiveCamera(Window, tt.Camera):
    def compute_matrix(self):
        gaze = self.at - self.eye
        u = np.cross(self.up, gaze)
        v = np.cross(gaze, u)
        matrix = np.eye(4)
        for column, axis in enumerate((u, v, gaze)):
            matrix[:3, column] = axis / np.linalg.norm(axis)
        matrix[:3, 3] = self.eye
        return matrix

    @ti.func
    def pixel_to_screen(self, i, j):
        l, r, b, t = self.edges()
        return tm.vec2(self.along(l, r, i, self.width), self.along(b, t, j, self.height))

    @ti.func
    def along(self, low, high, index, count):
        return (low * (count - index - 0.5) + high * (index + 0.5)) / count

    @ti.func
    def generate_ray(self, i, j):
        e, u, v, w = self.frame()
        uv = self.pixel_to_screen(i, j)
        d = tm.vec3(0.0, 0.0, 0.0)
        d.x = w.x + uv.x * u.x + uv.y * v.x
        d.y = w.y + uv.x * u.y + uv.y * v.y
        d.z = w.z + uv.x * u.z + uv.y * v.z
        return tt.Ray(origin=e, direction=tm.normalize(d))


@ti.data_oriented
class OrthographicCamera(Window, tt.OrthographicCamera):
    @ti.func
    def generate_ray(self, i, j):
        l, r, b, t = self.edges()
        u_share, v_share = (i + 0.5) / self.width, (j + 0.5) / self.height
        e, u, v, w = self.frame()
        x = (1 - u_share) * l + u_share * r
        y = (1 - v_share) * b + v_share * t
        return tt.Ray(origin=e + ti.Matrix.cols([u, v]) @ tm.vec2(x, y), direction=w / w.norm())
