"""The handout's sampler of mesh lights (A3-2)."""

import numpy as np
import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.area_lights import uniform_triangle
from taichi_tracer.formulas.random_numbers import given_or_drawn
from taichi_tracer.formulas.spheres import widened
from taichi_tracer.lights.choice import LampChoice, LampTable
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import filled, varying
from taichi_tracer.system.parts import call_with_known_args, overridable


@ti.data_oriented
@overridable(
    "compute_triangle_area", "compute_cdf", "sample_emissive_triangle", "evaluate_probability", "sample_mesh_lights"
)
class MeshLightSampler(LampChoice):
    """The handout's sampler of mesh lights: a point uniform on all emissive triangles together (A3-2).

    The lamp choice "area" in the folder ``lights`` has the same density, and takes its numbers so that samples are
    distributed more evenly. This class takes its place as soon as one of its methods is replaced, either in a subclass
    (``lamp_choice=MyMeshLightSampler``) or by an assignment to ``MeshLightSampler``. All triangles have one density, so
    that one with less than 2⁻²⁴ of their area, the step of a random number in f32, may be lost; "area" keeps it.

    Attributes:
        emissive_triangle_ids: field of the ids of the triangles whose material has Ke > 0.
        n_emissive_triangles: their number.
        cdf: field of as many numbers: ``cdf[i]`` is the area of the first i + 1 of them / the total area.
        total_area: the sum of their areas.
    """

    name, samples_points = "handout", True

    def prepare(self, lamps: LampTable) -> None:
        """Compute the areas and their cumulative distribution."""
        if (lamps.primitives < 0).any():
            raise InputError(f"{type(self).__name__} samples triangles, but a sphere emits: use lamp_choice='power'")
        self.n_emissive_triangles = varying(len(lamps))
        zeros = np.zeros(len(lamps))
        self._memory, fields = filled(lamps.primitives, zeros, zeros)
        self.emissive_triangle_ids, self.cdf, self.areas = fields
        self._compute_areas()
        self.total_area = float(self.areas.to_numpy().astype(np.float64).sum())
        self.compute_cdf()

    @ti.kernel
    def _compute_areas(self):
        for i in self.areas:
            v0, v1, v2 = self.geometry.triangle(self.emissive_triangle_ids[i])
            self.areas[i] = call_with_known_args(self.compute_triangle_area, v0, v1, v2)

    @staticmethod
    @ti.func
    def compute_triangle_area(v0, v1, v2):
        """|(v1 − v0) × (v2 − v0)| / 2."""
        return tm.length(tm.cross(v1 - v0, v2 - v0)) / 2

    @ti.kernel
    def compute_cdf(self):
        """Sum up the areas. The sum is kept in f64 where the backend has it, so that it stays exact."""
        total = widened(0.0)
        ti.loop_config(serialize=True)
        for i in range(self.n_emissive_triangles):
            total += self.areas[i]
            self.cdf[i] = total / self.total_area

    @ti.func
    def sample_emissive_triangle(self, xi: ti.template() = None):
        """i of a triangle, in proportion to the areas: a binary search for cdf[i − 1] ≤ ξ < cdf[i].

        Its id is ``emissive_triangle_ids[i]``. ``xi`` is a pair of numbers, of which one is used.
        """
        low, high, number = 0, self.n_emissive_triangles - 1, given_or_drawn(xi).x
        while low < high:
            middle = (low + high) >> 1
            if number < self.cdf[middle]:
                high = middle
            else:
                low = middle + 1
        return low

    @ti.func
    def evaluate_probability(self):
        """1/total area: the density of the point, per area."""
        return 1 / self.total_area

    @ti.func
    def sample_mesh_lights(self, hit_point, xi: ti.template() = None):
        """(w_i, triangle id) of the direction from a point to a point that is uniform on the emissive triangles."""
        triangle_id = self.emissive_triangle_ids[call_with_known_args(self.sample_emissive_triangle)]
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        place = uniform_triangle(given_or_drawn(xi))
        y = v0 + place.x * (v1 - v0) + place.y * (v2 - v0)
        return tm.normalize(y - hit_point), triangle_id

    @ti.func
    def choose(self, x, n, xi):
        """(i, probability, ξ) of the i-th emissive triangle."""
        i = call_with_known_args(self.sample_emissive_triangle, xi=tm.vec2(xi))
        return i, self.probability(x, n, i), xi

    @ti.func
    def probability(self, x, n, lamp):
        """Its area × ``evaluate_probability``."""
        return self.areas[lamp] * call_with_known_args(self.evaluate_probability)
