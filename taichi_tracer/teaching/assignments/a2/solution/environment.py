"""Assignment 2, part 2: light from an environment, which is infinitely far away."""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class Environment(tt.Environment):
    """An equirectangular picture of the light from all directions.

    In kernels, ``self.texels[row, column]`` is the radiance of a texel, a vec3, with the top row first. ``self.height``
    and ``self.width`` are the numbers of rows and columns.
    """

    @ti.func
    def query_ray(self, ray):
        """The radiance (vec3) of the texel in the direction d of a ray. d has the length 1.

            u = 1/2 + atan2(d.z, d.x)/(2π)        v = 1/2 + asin(d.y)/π

        u runs from the left to the right of the picture, v from the bottom to the top. Rounding can make d.y a little
        larger than 1, where asin is not defined, and u or 1 − v can be 1, where there is no texel.
        """
        radiance = tm.vec3(0)
        ### BEGIN SOLUTION
        d = ray.direction
        u = 0.5 + tm.atan2(d.z, d.x) / (2 * tm.pi)
        v = 0.5 + tm.asin(tm.clamp(d.y, -1, 1)) / tm.pi
        column = ti.min(int(u * self.width), self.width - 1)
        row = ti.min(int((1 - v) * self.height), self.height - 1)
        radiance = self.texels[row, column]
        ### END SOLUTION
        return radiance
