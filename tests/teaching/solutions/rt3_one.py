"""Assignment rt3 as student one writes it."""

import numpy as np
import taichi as ti
import taichi.math as tm
from camera import Window

import taichi_tracer as tt


@ti.data_oriented
class PerspectiveCamera(Window, tt.Camera):
    def compute_matrix(self):
        forward = np.array(self.at) - np.array(self.eye)
        forward = forward / np.sqrt((forward**2).sum())
        right = np.cross(np.array(self.up), forward)
        right = right / np.sqrt((right**2).sum())
        up = np.cross(forward, right)
        return np.array([[*column, 0.0] for column in (right, up, forward)] + [[*self.eye, 1.0]]).T

    @ti.func
    def pixel_to_screen(self, i, j):
        l, r, b, t = self.edges()
        s = (i + 0.5) / self.width
        q = (j + 0.5) / self.height
        return tm.vec2((1.0 - s) * l + s * r, (1.0 - q) * b + q * t)

    @ti.func
    def generate_ray(self, i, j):
        p = self.pixel_to_screen(i, j)
        e, u, v, w = self.frame()
        direction = p.x * u + p.y * v + w
        return tt.Ray(origin=e, direction=direction / direction.norm())


@ti.data_oriented
class OrthographicCamera(Window, tt.OrthographicCamera):
    @ti.func
    def generate_ray(self, i, j):
        l, r, b, t = self.edges()
        e, u, v, w = self.frame()
        p = tm.mix(tm.vec2(l, b), tm.vec2(r, t), tm.vec2((i + 0.5) / self.width, (j + 0.5) / self.height))
        return tt.Ray(origin=e + p.x * u + p.y * v, direction=w)
