"""Assignment 3, part 1: points on the surfaces that emit light, and directions towards a bright environment."""

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@ti.data_oriented
class MeshLightSampler(tt.MeshLightSampler):
    """Chooses a point that is uniform on all emissive triangles together.

    In kernels: ``self.n_emissive_triangles``; ``self.emissive_triangle_ids[i]``, the id of the i-th of them;
    ``self.areas[i]``, its area; ``self.total_area``; ``self.cdf[i]``, which ``compute_cdf`` fills; and
    ``self.geometry.triangle(triangle_id)``, the three corners of a triangle.
    """

    @staticmethod
    @ti.func
    def compute_triangle_area(v0, v1, v2):
        """The area of a triangle: |(v1 − v0) × (v2 − v0)| / 2."""
        area = 1.0
        ### BEGIN SOLUTION
        area = tm.cross(v1 - v0, v2 - v0).norm() / 2
        ### END SOLUTION
        return area

    @ti.kernel
    def compute_cdf(self):
        """Fill ``self.cdf``: cdf[i] is the area of the first i + 1 triangles, divided by the total area.

        Every number needs the one before it. ``ti.loop_config(serialize=True)`` before a loop lets it run in order.
        """
        ### BEGIN SOLUTION
        total = 0.0
        ti.loop_config(serialize=True)
        for i in range(self.n_emissive_triangles):
            total += self.areas[i]
            self.cdf[i] = total / self.total_area
        ### END SOLUTION

    @ti.func
    def sample_emissive_triangle(self):
        """i of a random triangle, in proportion to the areas: cdf[i − 1] ≤ ξ < cdf[i], found by a binary search."""
        i = 0
        ### BEGIN SOLUTION
        low = 0
        high = self.n_emissive_triangles - 1
        xi = ti.random()
        while low < high:
            middle = (low + high) // 2
            if xi < self.cdf[middle]:
                high = middle
            else:
                low = middle + 1
        i = low
        ### END SOLUTION
        return i

    @ti.func
    def evaluate_probability(self):
        """The density of the point, per area: 1/total area."""
        probability = 1.0
        ### BEGIN SOLUTION
        probability = 1 / self.total_area
        ### END SOLUTION
        return probability

    @ti.func
    def sample_mesh_lights(self, hit_point):
        """(w_i, triangle_id): the direction (vec3) from a point to a random point y on a random emissive triangle.

        Choose the triangle by ``self.sample_emissive_triangle()``. The point is uniform on it with

            ξ0 < ξ1:   b0 = ξ0/2,  b1 = ξ1 − b0        otherwise:   b1 = ξ1/2,  b0 = ξ0 − b1

            y = b0 v0 + b1 v1 + (1 − b0 − b1) v2
        """
        w_i = tm.vec3(0, 1, 0)
        triangle_id = 0
        ### BEGIN SOLUTION
        triangle_id = self.emissive_triangle_ids[self.sample_emissive_triangle()]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        xi0 = ti.random()
        xi1 = ti.random()
        b0 = xi0 / 2
        b1 = xi1 - b0
        if xi0 >= xi1:
            b1 = xi1 / 2
            b0 = xi0 - b1
        y = b0 * v0 + b1 * v1 + (1 - b0 - b1) * v2
        w_i = tm.normalize(y - hit_point)
        ### END SOLUTION
        return w_i, triangle_id


class EnvironmentSampler:
    """Chooses texels of an environment in proportion to the light that arrives from them. Python calls it."""

    def compute_probabilities(self, image):
        """The probability of each texel of an (h, w, 3) picture, as an array of shape (h, w) whose sum is 1.

        It is proportional to luminance · sin θ. The luminance is 0.2126 R + 0.7152 G + 0.0722 B. θ is the angle between
        the middle of the row and the upward direction: π (row + 0.5)/h, with the top row first.
        """
        height, width, _ = image.shape
        probabilities = np.full((height, width), 1 / (height * width))
        ### BEGIN SOLUTION
        luminance = image @ np.array([0.2126, 0.7152, 0.0722])
        theta = np.pi * (np.arange(height) + 0.5) / height
        weights = luminance * np.sin(theta)[:, None]
        probabilities = weights / weights.sum()
        ### END SOLUTION
        return probabilities

    def evaluate_density(self, probabilities):
        """The density per solid angle in the middle of each texel, as an array of shape (h, w).

        A texel has the solid angle (2π/w) (π/h) sin θ.
        """
        height, width = probabilities.shape
        density = np.zeros((height, width))
        ### BEGIN SOLUTION
        theta = np.pi * (np.arange(height) + 0.5) / height
        solid_angle = (2 * np.pi / width) * (np.pi / height) * np.sin(theta)[:, None]
        density = probabilities / solid_angle
        ### END SOLUTION
        return density


@ti.data_oriented
class Environment(tt.Environment):
    """Optional: points of the image in proportion to the light that arrives from them. Kernels call it.

    ``self.image[x, y]`` is the radiance of a texel, a vec3, with y = 0 at the bottom. ``self.image_scalar[x, y]``,
    ``self.cdf_ptheta[y]`` and ``self.cdf_p_phi_given_theta[x, y]`` are the tables that the methods fill.
    """

    def __init__(self, image, **options):
        super().__init__(image, **options)
        width, height = int(self.x_resolution), int(self.y_resolution)
        self.image_scalar = ti.field(float, (width, height))
        self.cdf_ptheta = ti.field(float, height)
        self.cdf_p_phi_given_theta = ti.field(float, (width, height))

    @ti.kernel
    def precompute_scalar(self):
        """Fill ``self.image_scalar``: the luminance 0.2126 R + 0.7152 G + 0.0722 B of each texel, times sin θ.

        θ = π (y + 0.5)/h belongs to the middle of row y. sin θ is how much smaller a texel is than at the equator.
        """
        ### BEGIN SOLUTION
        for x, y in self.image_scalar:
            theta = tm.pi * (y + 0.5) / self.y_resolution
            luminance = tm.dot(self.image[x, y], tm.vec3(0.2126, 0.7152, 0.0722))
            self.image_scalar[x, y] = luminance * ti.sin(theta)
        ### END SOLUTION

    def precompute_cdfs(self):
        """Given: fill the other tables: the rows up to y have the share cdf_ptheta[y] of the light.

        cdf_p_phi_given_theta[x, y] is the share that the texels up to x have of the light of row y.
        """
        texels = np.cumsum(self.image_scalar.to_numpy(), axis=0)
        rows = np.cumsum(texels[-1])
        self.cdf_p_phi_given_theta.from_numpy(texels / texels[-1])
        self.cdf_ptheta.from_numpy(rows / rows[-1])

    def precompute_envmap(self):
        """Fill all tables."""
        self.precompute_scalar()
        self.precompute_cdfs()

    @ti.func
    def importance_sample_envmap(self):
        """A random point (u, v) of the image (vec2, in [0, 1)²), in proportion to ``self.image_scalar``.

        First a row is drawn, then a texel in it: those with cdf[i − 1] ≤ ξ < cdf[i]. The place of ξ between these two
        numbers is the place of the point in the row, or in the texel:

            f = (ξ − cdf[i − 1])/(cdf[i] − cdf[i − 1])        u = (x + f_x)/w        v = (y + f_y)/h
        """
        point = tm.vec2(0)
        ### BEGIN SOLUTION
        xi_y = ti.random()
        y = 0
        while y < self.y_resolution - 1 and self.cdf_ptheta[y] <= xi_y:
            y += 1
        below = 0.0
        if y > 0:
            below = self.cdf_ptheta[y - 1]
        f_y = (xi_y - below) / (self.cdf_ptheta[y] - below)

        xi_x = ti.random()
        x = 0
        while x < self.x_resolution - 1 and self.cdf_p_phi_given_theta[x, y] <= xi_x:
            x += 1
        left = 0.0
        if x > 0:
            left = self.cdf_p_phi_given_theta[x - 1, y]
        f_x = (xi_x - left) / (self.cdf_p_phi_given_theta[x, y] - left)

        point = tm.vec2((x + f_x) / self.x_resolution, (y + f_y) / self.y_resolution)
        ### END SOLUTION
        return point
