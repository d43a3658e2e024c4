"""Assignment 2, part 3: random directions, their densities, and the BRDF.

All directions have the length 1 and point away from the surface: w_o to the viewer, w_i to the light. Densities are per
solid angle. A material is diffuse if ``material.Ns`` is 1, and Phong with the exponent α = ``material.Ns`` if it is
larger. ``material.Kd`` is the reflectance in both cases.
"""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class UniformSampler(tt.UniformSampler):
    """Directions uniform on the whole sphere."""

    @staticmethod
    @ti.func
    def sample_direction():
        """A random direction (vec3), made of two random numbers ξ1 and ξ2:

        ω_z = 2 ξ1 − 1      r = √(1 − ω_z²)      φ = 2π ξ2      ω = (r cos φ, r sin φ, ω_z)
        """
        direction = tm.vec3(0, 0, 1)
        ### BEGIN SOLUTION
        z = 2 * ti.random() - 1
        r = ti.sqrt(1 - z * z)
        phi = 2 * tm.pi * ti.random()
        direction = tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z)
        ### END SOLUTION
        return direction

    @staticmethod
    @ti.func
    def evaluate_probability():
        """The density of these directions: its integral over the sphere, whose solid angle is 4π, is 1."""
        probability = 1.0
        ### BEGIN SOLUTION
        probability = 1 / (4 * tm.pi)
        ### END SOLUTION
        return probability


@ti.data_oriented
class BRDF(tt.BRDF):
    """How a surface reflects, and directions that are drawn in proportion to it."""

    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal):
        """A random direction w_i (vec3) from a lobe around an axis: the normal (diffuse) or ω_r (Phong).

            ω_r = 2 (n·ω_o) n − ω_o

            ω_z = ξ1^(1/(α+1))      r = √(1 − ω_z²)      φ = 2π ξ2

        with α = 1 for a diffuse material. (r cos φ, r sin φ, ω_z) is a direction around the z axis. Turn it into a
        frame of three perpendicular unit vectors whose third is the axis. The frame must exist for every axis.
        """
        w_i = normal
        ### BEGIN SOLUTION
        axis = normal
        alpha = 1.0
        if material.Ns > 1:
            axis = 2 * tm.dot(normal, w_o) * normal - w_o
            alpha = material.Ns

        z = ti.pow(ti.random(), 1 / (alpha + 1))
        r = ti.sqrt(1 - z * z)
        phi = 2 * tm.pi * ti.random()

        other = tm.vec3(1, 0, 0)
        if abs(axis.x) > 0.9:
            other = tm.vec3(0, 1, 0)
        tangent = tm.normalize(tm.cross(other, axis))
        bitangent = tm.cross(axis, tangent)
        w_i = r * ti.cos(phi) * tangent + r * ti.sin(phi) * bitangent + z * axis
        ### END SOLUTION
        return w_i

    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        """The density of ``sample_direction`` at w_i.

        diffuse: max(0, n·ω_i)/π              Phong: (α+1)/(2π) · max(0, ω_r·ω_i)^α
        """
        probability = 1.0
        ### BEGIN SOLUTION
        probability = ti.max(0.0, tm.dot(normal, w_i)) / tm.pi
        if material.Ns > 1:
            w_r = 2 * tm.dot(normal, w_o) * normal - w_o
            cosine = ti.max(0.0, tm.dot(w_r, w_i))
            probability = (material.Ns + 1) / (2 * tm.pi) * ti.pow(cosine, material.Ns)
        ### END SOLUTION
        return probability

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        """f_r (vec3), without the cosine.

        diffuse: Kd/π                         Phong: Kd (α+1)/(2π) · max(0, ω_r·ω_i)^α
        """
        brdf = tm.vec3(0)
        ### BEGIN SOLUTION
        brdf = material.Kd / tm.pi
        if material.Ns > 1:
            w_r = 2 * tm.dot(normal, w_o) * normal - w_o
            cosine = ti.max(0.0, tm.dot(w_r, w_i))
            brdf = material.Kd * (material.Ns + 1) / (2 * tm.pi) * ti.pow(cosine, material.Ns)
        ### END SOLUTION
        return brdf

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        """f_r max(n·ω_i, 0) / pdf (vec3) for a w_i of ``sample_direction``, with everything cancelled that cancels.

        diffuse: Kd                           Phong: Kd max(n·ω_i, 0)
        """
        factor = tm.vec3(0)
        ### BEGIN SOLUTION
        factor = material.Kd
        if material.Ns > 1:
            factor = material.Kd * ti.max(0.0, tm.dot(normal, w_i))
        ### END SOLUTION
        return factor
