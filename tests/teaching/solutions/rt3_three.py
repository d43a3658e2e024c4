"""Assignment rt3 as student three writes it."""

import numpy as np
import taichi as ti
import taichi.math as tm
from camera import Window

import taichi_tracer as tt


@ti.data_oriented
class PerspectiveCamera(Window, tt.Camera):
    def compute_matrix(self):
        def normalised(vector):
            return vector / np.linalg.norm(vector)

        w = normalised(self.at - self.eye)
        u = normalised(np.cross(normalised(self.up), w))
        rotation = np.array([u, np.cross(w, u), w]).T
        return np.block([[rotation, np.array(self.eye).reshape(3, 1)], [np.zeros((1, 3)), np.ones((1, 1))]])

    @ti.func
    def pixel_to_screen(self, i, j):
        edges = self.edges()
        x = (2 * i + 1) * (edges[1] - edges[0]) / (2 * self.width) + edges[0]
        y = (2 * j + 1) * (edges[3] - edges[2]) / (2 * self.height) + edges[2]
        return tm.vec2(x, y)

    @ti.func
    def generate_ray(self, i, j):
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0))
        uv = self.pixel_to_screen(i, j)
        e, u, v, w = self.frame()
        d = ti.Matrix.cols([u, v, w]) @ tm.vec3(uv, 1)
        ray.origin = e
        ray.direction = d * (1 / ti.sqrt(1 + uv.x**2 + uv.y**2))
        return ray


@ti.data_oriented
class OrthographicCamera(Window, tt.OrthographicCamera):
    @ti.func
    def generate_ray(self, i, j):
        ray = tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0))
        half, centre = self.half_size[None], self.centre[None]
        ndc = tm.vec2(2 * (i + 0.5) / self.width - 1, 2 * (j + 0.5) / self.height - 1)
        p = centre + half * ndc
        e, u, v, w = self.frame()
        for k in ti.static(range(3)):
            ray.origin[k] = e[k] + p.x * u[k] + p.y * v[k]
            ray.direction[k] = w[k]
        return ray
