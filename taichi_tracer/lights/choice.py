"""The interface of a choice among lamps: which of the surfaces that emit gets the sample?

    lamp, probability, rest = choice.choose(x, n, xi)

The three choices trade time for variance. ``area`` is the course's (A3-2): it only looks at areas. ``power`` looks at
the emitted light, too. ``hierarchy`` also looks at the point that is lit.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from taichi_tracer.system.parts import overridable


@dataclass(frozen=True)
class LampTable:
    """The surfaces of a scene that emit light, as numpy arrays in float64; one row each.

    Attributes:
        primitives: (L,) int32, the id of a triangle, or −1 − the id of a sphere.
        ids: (L,) int32, the numbers of the same primitives in the order of the file, as in ``HitData``.
        materials: (L,) int64, the ids of their materials.
        areas: (L,) their areas.
        radiance: (L,) luminance of Ke, see ``formulas.luminance``.
        low, high: (L, 3) corners of their boxes.
        normals: (L, 3) unit normals of the sides that emit; 0 for spheres, which emit to all sides.
        two_sided: whether triangles emit from both sides.
    """

    primitives: np.ndarray
    ids: np.ndarray
    materials: np.ndarray
    areas: np.ndarray
    radiance: np.ndarray
    low: np.ndarray
    high: np.ndarray
    normals: np.ndarray
    two_sided: bool

    def __len__(self) -> int:
        return len(self.primitives)


@ti.data_oriented
@overridable(choose="number number number", probability="number")
class LampChoice:
    """The interface. A subclass defines ``prepare``, ``choose`` and ``probability``.

    Attributes:
        name: its name in the registry, which ``lamp_choice=`` takes.
        geometry: of the scene, which sets it before it calls ``prepare``.
        samples_points: whether it chooses the point on the lamp, too, as the handout's ``MeshLightSampler`` does. Then
            it has the methods ``sample_mesh_lights`` and ``evaluate_probability`` of that class.
        keeps_area: whether points are uniform in area on every triangle, as the handout asks (A3-2). If not, those on a
            triangle that is seen as large are uniform in solid angle, see ``Lamps``.
    """

    kind, name, samples_points, keeps_area = "lamp choice", "", False, False
    required: tuple[str, ...] = ("choose", "probability")
    geometry: Any = None

    def prepare(self, lamps: LampTable) -> None:
        """Build the tables for the lamps of a scene. Called once, before the first kernel that asks for a choice."""

    @ti.func
    def choose(self, x, n, xi):
        """(lamp, probability, rest) for the point x with the normal n, made of one random number ξ in [0, 1).

        The rest is ξ within the interval that belongs to the lamp, stretched to [0, 1). The place on the lamp is made
        of it. Samples that are well distributed in ξ are then well distributed over all lamps together.
        """
        ti.static_assert(False, "a choice of lamps must say what choose(self, x, n, xi) is")

    @ti.func
    def probability(self, x, n, lamp):
        """The probability with which ``choose`` returns ``lamp`` for the same x and n."""
        ti.static_assert(False, "a choice of lamps must say what probability(self, x, n, lamp) is")
