"""What a light is: something that can be sampled from a point, and that a ray may see.

Directions have unit length and lead away from the point that is lit, in world space. Densities are per solid angle as
seen from that point. Radiance is linear RGB, without any cosine and without the question whether something is in the
way: that is the integrators' to ask.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.system.seams import seams


@ti.data_oriented
@seams("sample", "pdf", "radiance")
class Light:
    """The interface. A subclass says ``sample``, and unless it is a delta light, ``pdf`` and ``radiance``.

    Attributes:
        name: what the registry and the receipt call it.
        is_delta: whether all its light comes from single directions, as that of a point: then no ray meets it by
            chance, ``sample`` returns a pdf of 1, and ``pdf`` and ``radiance`` are 0.
        is_far: whether it is infinitely far away: ``sample`` returns the distance ∞, and only rays that meet nothing
            see it.
    """

    kind, name, is_delta, is_far = "light", "", False, False
    version = 0  # counts changes, so that a renderer knows when its samples are of another picture

    def prepare(self) -> None:
        """Allocate what ``sample`` needs; called before the first kernel that samples this light."""

    def facts(self) -> dict:
        """What the bits of a picture depend on, for checkpoints; the numbers of the light's attributes."""
        return {name: repr(value) for name, value in sorted(vars(self).items()) if not name.startswith("_")}

    @ti.func
    def sample(self, x, xi):
        """(w_i, distance, radiance, pdf): a direction from the point x to this light, made of ``xi`` in [0, 1)²."""
        ti.static_assert(False, "a light must say what sample(self, x, xi) is")
        return tm.vec3(0, 1, 0), tm.inf, tm.vec3(0), 1.0

    @ti.func
    def pdf(self, x, w_i, hit):
        """The density of ``sample`` at the direction w_i, where the ray from x meets ``hit``."""
        return 0.0

    @ti.func
    def radiance(self, ray, hit):
        """Radiance that arrives along the ray from this light, where the ray meets ``hit``."""
        return tm.vec3(0)
