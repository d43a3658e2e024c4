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
        # Tables for sampling
        self.image_scalar = ti.field(dtype=float, shape=(self.x_resolution, self.y_resolution))
        self.p_theta = ti.field(dtype=float, shape=(self.y_resolution))
        self.p_phi = ti.field(dtype=float, shape=(self.x_resolution, self.y_resolution))
        self.theta_cdf = ti.field(dtype=float, shape=(self.y_resolution))
        self.phi_cdf = ti.field(dtype=float, shape=(self.x_resolution, self.y_resolution))
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

    # 546 part
    @ti.kernel
    def precompute_envmap(self):
        self.precompute_scalar()
        self.precompute_marginal_ptheta()
        self.precompute_conditional_p_phi_given_theta()
        self.precompute_cdfs()

    @ti.func
    def precompute_scalar(self):
        for x, y in ti.ndrange(self.x_resolution, self.y_resolution):
            c = self.image[x, y]
            sin_theta = ti.sin(tm.pi * (y + 0.5) / self.y_resolution)
            self.image_scalar[x, y] = (0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b) * sin_theta

    @ti.func
    def precompute_marginal_ptheta(self):
        for y in range(self.y_resolution):
            self.p_theta[y] = 0.0
            for x in range(self.x_resolution):
                self.p_theta[y] += self.image_scalar[x, y]
        all_rows = 0.0
        for y in range(self.y_resolution):
            all_rows += self.p_theta[y]
        for y in range(self.y_resolution):
            self.p_theta[y] /= all_rows

    @ti.func
    def precompute_conditional_p_phi_given_theta(self):
        for y in range(self.y_resolution):
            s = 0.0
            for x in range(self.x_resolution):
                s += self.image_scalar[x, y]
            for x in range(self.x_resolution):
                self.p_phi[x, y] = self.image_scalar[x, y] / s

    @ti.func
    def precompute_cdfs(self):
        t = 0.0
        ti.loop_config(serialize=True)
        for y in range(self.y_resolution):
            t += self.p_theta[y]
            self.theta_cdf[y] = t
        for y in range(self.y_resolution):
            p = 0.0
            for x in range(self.x_resolution):
                p += self.p_phi[x, y]
                self.phi_cdf[x, y] = p

    @ti.func
    def sample_theta(self, u1: float) -> int:
        i = 0
        while i < self.y_resolution - 1 and self.theta_cdf[i] < u1:
            i += 1
        return i

    @ti.func
    def sample_phi(self, theta: int, u2: float) -> int:
        i = 0
        while i < self.x_resolution - 1 and self.phi_cdf[i, theta] < u2:
            i += 1
        return i

    @ti.func
    def importance_sample_envmap(self) -> tm.vec2:
        u1 = ti.random()
        u2 = ti.random()
        t = self.sample_theta(u1)
        p = self.sample_phi(t, u2)
        t0 = 0.0
        if t > 0: t0 = self.theta_cdf[t - 1]
        p0 = 0.0
        if p > 0: p0 = self.phi_cdf[p - 1, t]
        v = lerp((u1 - t0) / (self.theta_cdf[t] - t0), t, t + 1) / float(self.y_resolution)
        u = lerp((u2 - p0) / (self.phi_cdf[p, t] - p0), p, p + 1) / float(self.x_resolution)
        return tm.vec2([u, v])


@ti.func
def lerp(x: float, a: float, b: float) -> float:
    return ((1.0-x) * a) + (x * b)
