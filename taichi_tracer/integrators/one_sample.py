"""Multiple importance sampling with one sample: either the lights or the BRDF, drawn by lot (A3-4).

The direction comes from the mixture p(ω) = mis_plight p_light(ω) + mis_pbrdf p_brdf(ω), so that the estimator is
f_r cos θ L / p. Both densities are per solid angle. The two-sample forms are in ``direct_light``.
"""

from typing import Any

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.base import Control, LiveNumbers
from taichi_tracer.integrators.direct_light import DirectLight, light_along, sample_of_lights
from taichi_tracer.settings import WEIGHTS, usual_values
from taichi_tracer.system.compile_time import inside_kernel
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts import register


@register
@ti.data_oriented
class OneSampleMis(DirectLight):
    """With the probability ``mis_plight`` a direction to a light, otherwise one from the BRDF.

    Attributes:
        weights: of mis_plight and mis_pbrdf; they are ≥ 0 and not both 0, and their sum is scaled to 1.
    """

    name, label, aliases = "mis_one_sample", "MIS, one sample", ()

    def __init__(self) -> None:
        self.weights, self.numbers = usual_values(WEIGHTS), LiveNumbers()

    def prepare(self, scene, camera) -> None:
        """Give kernels the weights."""
        self.numbers.set(self.p_light)

    @property
    def p_light(self) -> float:
        """The probability of a sample of the lights."""
        return self.weights["mis_plight"] / sum(self.weights.values())

    def __getitem__(self, name: str) -> Any:
        if not inside_kernel():
            return float(self.weights[name])
        p_light = self.numbers.get(0)  # the weights in kernels are scaled
        return p_light if name == "mis_plight" else 1 - p_light

    def set(self, **weights: float) -> None:
        """Change one of the ``weights``, or both.

        Raises:
            InputError: one of them is negative or not finite, or both are 0; then nothing has changed.
        """
        changed = self.weights | weights
        check(**changed)
        if changed != self.weights:
            self.weights = changed
            self.version += 1
            self.numbers.set(self.p_light)

    def controls(self) -> tuple[Control, ...]:
        """Both weights."""
        return tuple(Control(name, weight, 0.0, 1.0) for name, weight in self.weights.items())

    def change(self, name: str, value: Any) -> None:
        """Change ``mis_plight`` or ``mis_pbrdf``; see ``set``."""
        if name not in self.weights:
            super().change(name, value)
        self.set(**{name: value})

    def facts(self) -> dict:
        """Everything that the bits of a picture depend on, for checkpoints."""
        return {"mis_plight": self.p_light}

    @ti.func
    def reflected(self, scene, surface, rng):
        """One sample of the light from the direction that was drawn; a mirror is sampled by its BRDF."""
        L, p_light, is_delta = tm.vec3(0), self.numbers.get(0), surface.is_delta()
        if rng.next_1d() >= 1 - p_light and not is_delta:
            f_cos, light, pdf, pdf_brdf = sample_of_lights(scene, surface, rng.next_2d_of_term())
            L = f_cos * light / pdf / (p_light + (1 - p_light) * pdf_brdf / pdf)
        else:
            w_i = surface.sample(rng.next_2d())
            light, pdf = light_along(scene, surface, w_i, surface.weight(w_i))
            pdf_brdf, share = surface.pdf(w_i), 1.0
            if not is_delta:
                share = ti.select(pdf_brdf > 0, 1 / (1 - p_light + p_light * pdf / pdf_brdf), 0.0)
            L = surface.weight(w_i) * light * share
        return L


def check(**weights: float) -> None:
    """Raise an InputError if one of the weights is negative or not finite, or if all are 0."""
    for name, weight in weights.items():
        if not isinstance(weight, int | float) or not 0 <= weight < float("inf"):
            raise InputError(f"{name} must be a number of at least 0, not {weight!r}")
    if sum(weights.values()) == 0:
        raise InputError(f"{' and '.join(weights)} must not both be 0")
