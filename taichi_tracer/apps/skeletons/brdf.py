"""A BRDF: how a surface reflects light."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Mine(tt.Brdf):
    """All directions are in world space, have unit length and leave the surface: w_o to the viewer, w_i to the light.

    n is the shading normal on the viewer's side. Densities are per solid angle. f_r has the unit 1/sr, and no cosine.
    ``parameters = {"shine": 0.5}`` in the class makes ``material.shine`` from a key of the MTL file.
    """

    name = "mine"

    def describes(self, material, dtype):
        """Whether this BRDF is that of a ``tt.Material``."""
        return material.Ns <= 1

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """f_r, a vec3: the same for all directions."""
        return material.Kd / tm.pi

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """The density of ``sample`` at w_i, a number: here cos θ / π."""
        return ti.max(0.0, tm.dot(n, w_i)) / tm.pi

    @ti.func
    def sample(self, material, w_o, n, xi):
        """w_i, made of the two random numbers xi in [0, 1)²: n plus a point of the unit sphere, as Malley's method."""
        z, phi = 1 - 2 * xi.x, 2 * tm.pi * xi.y
        r = ti.sqrt(ti.max(0.0, 1 - z * z))
        return tm.normalize(1.0001 * n + tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z))
