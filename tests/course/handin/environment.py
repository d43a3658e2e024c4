import taichi as ti
import taichi.math as tm
import numpy as np
from .ray import Ray

@ti.data_oriented
class Environment:
    def __init__(self, image: np.array):
        self.x_resolution = image.shape[0]
        self.y_resolution = image.shape[1]
        self.image = ti.Vector.field(n=3, dtype=float, shape=(self.x_resolution, self.y_resolution))
        self.image.from_numpy(image)
        self.intensity = ti.field(dtype=float, shape=())
        self.set_intensity(1.)

    def set_intensity(self, intensity: float) -> None:
        self.intensity[None] = intensity

    @ti.func
    def query_ray(self, ray: Ray) -> tm.vec3:
        d = ray.direction
        u = 0.5 + ti.atan2(d.z, d.x) / (2 * tm.pi)
        v = 0.5 + ti.asin(tm.clamp(d.y, -1.0, 1.0)) / tm.pi
        x = ti.min(ti.cast(u * self.x_resolution, int), self.x_resolution - 1)
        y = ti.min(ti.cast(v * self.y_resolution, int), self.y_resolution - 1)
        return self.intensity[None] * self.image[x, y]
