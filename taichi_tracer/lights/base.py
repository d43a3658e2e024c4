"""The interface of a light: it can be sampled from a point, and a ray may see it.

Directions are in world space, have unit length and point away from the point that is lit. Densities are per solid
angle, seen from that point. Radiance is linear RGB. It includes neither a cosine nor the visibility: integrators check
whether something blocks the light.
"""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.system.parts import KnownAttributes, overridable


@ti.data_oriented
@overridable(sample="vec3 number vec3 number", pdf="number", radiance="vec3")
class Light(KnownAttributes):
    """The interface. A subclass defines ``sample``; if it is not a delta light, also ``pdf`` and ``radiance``.

    Attributes:
        name: its name in the registry and in the receipt.
        is_delta: whether all its light arrives from single directions, like the light of a point. Then a random ray
            never hits it, ``sample`` returns a pdf of 1, and ``pdf`` and ``radiance`` are 0.
        is_far: whether it is infinitely far away. Then ``sample`` returns the distance ∞, and only rays that hit
            nothing see it.
        is_ambient: whether it has no direction. Then it defines ``reflected`` and nothing else.
    """

    kind, name, is_delta, is_far, is_ambient = "light", "", False, False, False
    required: tuple[str, ...] = ("sample",)
    version = 0  # counts changes, so that a renderer knows when its samples belong to an older picture

    def prepare(self) -> None:
        """Allocate the tables that ``sample`` needs. Called once, before the first kernel that samples it."""

    def facts(self) -> dict:
        """Everything that the bits of a picture depend on, for checkpoints: the public attributes of the light."""
        return {name: repr(value) for name, value in sorted(vars(self).items()) if not name.startswith("_")}

    @ti.func
    def sample(self, x, xi):
        """(w_i, distance, radiance, pdf) of a direction from the point x to this light, made of ``xi`` in [0, 1)²."""
        ti.static_assert(False, "a light must say what sample(self, x, xi) is")

    @ti.func
    def pdf(self, x, w_i, hit):
        """The density of ``sample`` at the direction w_i; ``hit`` is what the ray from x along w_i hits."""
        return 0.0

    @ti.func
    def radiance(self, ray, hit):
        """Radiance that arrives along the ray from this light; ``hit`` is what the ray hits."""
        return tm.vec3(0)

    @ti.func
    def reflected(self, material):
        """What a surface of this ``material`` shows of an ambient light, linear RGB."""
        ti.static_assert(False, "an ambient light must say what reflected(self, material) is")
