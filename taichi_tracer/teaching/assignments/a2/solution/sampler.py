"""Assignment 2, part 3: random directions, their densities, and the BRDF.

All directions have the length 1 and point away from the surface: w_o to the viewer, w_i to the light. Densities are
per solid angle. A material is diffuse if ``material.Ns`` is 1 or less, and Phong with the exponent α = ``material.Ns``
if it is larger. ``material.Kd`` is the reflectance in both cases.
"""

import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.sampler import ortho_frames


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


@ti.data_oriented
class MicrofacetBRDF(tt.MicrofacetBRDF):
    """Optional: a rough metal, made of tiny mirrors whose normals ω_m are distributed by GGX.

    The material has ``alpha_x``, ``alpha_y`` and ``F0``. All coordinates are in a frame of three perpendicular unit
    vectors, whose third is the normal: ``ortho_frames(normal).transpose() @ w`` gives them. With

        t = (x_m/α_x)² + (y_m/α_y)² + z_m²            D = 1 / (π α_x α_y t²)

        Λ(ω) = (√(1 + ((α_x x)² + (α_y y)²)/z²) − 1) / 2          F = F0 + (1 − F0) (1 − ω_o·ω_m)⁵
    """

    @staticmethod
    @ti.func
    def sample_direction(material, w_o, normal):
        """A random direction w_i (vec3): w_o mirrored at a normal that is visible from w_o.

        Stretch ω_o to u = normalize(α_x x, α_y y, z). Draw z = (1 − ξ2)(1 + u_z) − u_z and φ = 2π ξ1, which give a
        point (r cos φ, r sin φ, z) of a spherical cap. Add u, multiply x and y by α again, and normalise: this is ω_m.
        """
        w_i = normal
        ### BEGIN SOLUTION
        frame = ortho_frames(normal)
        o = frame.transpose() @ w_o
        stretch = tm.vec3(material.alpha_x, material.alpha_y, 1)
        u = tm.normalize(stretch * o)
        z = (1 - ti.random()) * (1 + u.z) - u.z
        r = ti.sqrt(ti.max(0.0, 1 - z * z))
        phi = 2 * tm.pi * ti.random()
        m = tm.normalize(stretch * (tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z) + u))
        w_i = frame @ (2 * tm.dot(m, o) * m - o)
        ### END SOLUTION
        return w_i

    @staticmethod
    @ti.func
    def evaluate_probability(material, w_o, w_i, normal):
        """The density of ``sample_direction`` at w_i: D_ω_o(ω_m) / (4 ω_o·ω_m), with ω_m between ω_o and ω_i, and

        D_ω_o(ω_m) = G1(ω_o) D(ω_m) max(0, ω_o·ω_m) / cos θ_o          G1(ω_o) = 1 / (1 + Λ(ω_o))
        """
        probability = 1.0
        ### BEGIN SOLUTION
        frame = ortho_frames(normal).transpose()
        o, i = frame @ w_o, frame @ w_i
        m = tm.normalize(o + i)
        a_x, a_y = material.alpha_x, material.alpha_y
        t = (m.x / a_x) ** 2 + (m.y / a_y) ** 2 + m.z**2
        D = 1 / (tm.pi * a_x * a_y * t * t)
        lambda_o = (ti.sqrt(1 + ((a_x * o.x) ** 2 + (a_y * o.y) ** 2) / o.z**2) - 1) / 2
        visible = D * ti.max(0.0, tm.dot(o, m)) / ((1 + lambda_o) * o.z)
        probability = visible / (4 * tm.dot(o, m))
        ### END SOLUTION
        return probability

    @staticmethod
    @ti.func
    def evaluate_brdf(material, w_o, w_i, normal):
        """f_r (vec3): D F G / (4 cos θ_i cos θ_o) with G = 1 / (1 + Λ(ω_o) + Λ(ω_i)); 0 below the horizon."""
        brdf = tm.vec3(0)
        ### BEGIN SOLUTION
        frame = ortho_frames(normal).transpose()
        o, i = frame @ w_o, frame @ w_i
        if o.z > 0 and i.z > 0:
            m = tm.normalize(o + i)
            a_x, a_y = material.alpha_x, material.alpha_y
            t = (m.x / a_x) ** 2 + (m.y / a_y) ** 2 + m.z**2
            D = 1 / (tm.pi * a_x * a_y * t * t)
            lambda_o = (ti.sqrt(1 + ((a_x * o.x) ** 2 + (a_y * o.y) ** 2) / o.z**2) - 1) / 2
            lambda_i = (ti.sqrt(1 + ((a_x * i.x) ** 2 + (a_y * i.y) ** 2) / i.z**2) - 1) / 2
            G = 1 / (1 + lambda_o + lambda_i)
            F = material.F0 + (1 - material.F0) * (1 - tm.dot(o, m)) ** 5
            brdf = D * F * G / (4 * i.z * o.z)
        ### END SOLUTION
        return brdf

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material, w_o, w_i, normal):
        """f_r cos θ_i / pdf (vec3), with everything cancelled that cancels: F G / G1(ω_o); 0 below the horizon."""
        factor = tm.vec3(0)
        ### BEGIN SOLUTION
        frame = ortho_frames(normal).transpose()
        o, i = frame @ w_o, frame @ w_i
        if o.z > 0 and i.z > 0:
            m = tm.normalize(o + i)
            a_x, a_y = material.alpha_x, material.alpha_y
            lambda_o = (ti.sqrt(1 + ((a_x * o.x) ** 2 + (a_y * o.y) ** 2) / o.z**2) - 1) / 2
            lambda_i = (ti.sqrt(1 + ((a_x * i.x) ** 2 + (a_y * i.y) ** 2) / i.z**2) - 1) / 2
            F = material.F0 + (1 - material.F0) * (1 - tm.dot(o, m)) ** 5
            factor = F * (1 + lambda_o) / (1 + lambda_o + lambda_i)
        ### END SOLUTION
        return factor
