"""RT3, lights: a point, a parallel light, a spot, and ambient light.

Every light says what reaches a point x of a surface: the unit direction ω_i from x to the light, how far away the light
is, and its light (vec3) at x, before any cosine and any shadow. The fourth number is 1: it is the density of random
lights, and these four are not random. For the same reason, ``xi`` is not needed.

In kernels, ``tm.vec3(self.position)`` is a vector of the light; so are ``intensity``, ``attenuation``, ``target``,
``direction`` and ``irradiance``. ``self.cutoff`` and ``self.falloff`` are numbers.
"""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class PointLight(tt.PointLight):
    """A point that shines equally in all directions."""

    @ti.func
    def sample(self, x, xi):
        """Direction, distance r and light at the point x. The position is p, and the attenuation (Kc, Kl, Kq):

        r = |p − x|        ω_i = (p − x)/r        light = I / (Kc + Kl r + Kq r²)
        """
        w_i, r, light = tm.vec3(0, 1, 0), 1.0, tm.vec3(0)
        ### BEGIN SOLUTION
        to_light = tm.vec3(self.position) - x
        r = to_light.norm()
        w_i = to_light / r
        k = tm.vec3(self.attenuation)
        light = tm.vec3(self.intensity) / (k.x + k.y * r + k.z * r**2)
        ### END SOLUTION
        return w_i, r, light, 1.0


@ti.data_oriented
class DirectionalLight(tt.DirectionalLight):
    """Parallel light, as from a sun."""

    @ti.func
    def sample(self, x, xi):
        """Direction, distance and light at the point x.

        ``self.direction`` is the way of the light, of any length, and ``self.irradiance`` its strength, the same
        everywhere. The light is infinitely far away: ``tm.inf``.
        """
        w_i, distance, light = tm.vec3(0, 1, 0), 1.0, tm.vec3(0)
        ### BEGIN SOLUTION
        w_i = -tm.normalize(tm.vec3(self.direction))
        distance = tm.inf
        light = tm.vec3(self.irradiance)
        ### END SOLUTION
        return w_i, distance, light, 1.0


@ti.data_oriented
class SpotLight(tt.SpotLight):
    """A point that shines into a cone around its axis, which goes from ``self.position`` to ``self.target``."""

    @ti.func
    def share(self, theta):
        """The share s of the light at the angle θ from the axis, in degrees.

        s is 1 up to ``self.falloff``, 0 from ``self.cutoff`` on, and linear in θ in between. Both angles may be the
        same: then the edge is sharp.
        """
        s = 0.0
        ### BEGIN SOLUTION
        if theta <= self.falloff:
            s = 1.0
        elif theta < self.cutoff:
            s = (self.cutoff - theta) / (self.cutoff - self.falloff)
        ### END SOLUTION
        return s

    @ti.func
    def sample(self, x, xi):
        """Direction, distance r and light at the point x: those of a point light, and the light times s(θ).

        θ is the angle at the light, between its axis and the way to x. Both have to be of length 1:

            cos θ = axis · (−ω_i)        light = s(θ) I / (Kc + Kl r + Kq r²)

        ``self.share`` takes degrees; ``tm.degrees`` makes them from radians. Rounding can make a cosine a little larger
        than 1, where acos is not defined.
        """
        w_i, r, light = tm.vec3(0, 1, 0), 1.0, tm.vec3(0)
        ### BEGIN SOLUTION
        to_light = tm.vec3(self.position) - x
        r = to_light.norm()
        w_i = to_light / r
        axis = tm.normalize(tm.vec3(self.target) - tm.vec3(self.position))
        cosine = tm.clamp(tm.dot(axis, -w_i), -1.0, 1.0)
        theta = tm.degrees(tm.acos(cosine))
        k = tm.vec3(self.attenuation)
        light = self.share(theta) * tm.vec3(self.intensity) / (k.x + k.y * r + k.z * r**2)
        ### END SOLUTION
        return w_i, r, light, 1.0


@ti.data_oriented
class AmbientLight(tt.AmbientLight):
    """A stand-in for all light that bounces: it comes from everywhere, and nothing blocks it."""

    @ti.func
    def reflected(self, material):
        """What a surface shows of this light (vec3): I_a k_a. k_a is ``material.Ka``, and I_a ``self.intensity``."""
        light = tm.vec3(0)
        ### BEGIN SOLUTION
        light = tm.vec3(self.intensity) * material.Ka
        ### END SOLUTION
        return light
