"""The interface of a BRDF: its value f_r, and the density from which its directions are drawn.

The conventions are the same for every BRDF. All directions are in world space, have unit length and point away from the
surface: w_o to the viewer and w_i to the light. n is the shading normal on the viewer's side. f_r does not include the
cosine. Densities are per solid angle. No light is reflected from a w_i below the horizon of n. Integrators check the
horizon of the triangle's plane.
"""

from typing import Any

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.parts import call_with_known_args, overridable, replaced, unfinished


@ti.data_oriented
@overridable(eval="vec3", pdf="number", sample="vec3", weight="vec3")
class Brdf:
    """The interface. A subclass defines ``describes``, ``eval``, ``pdf`` and ``sample``.

    Attributes:
        name: its name in the registry, in the receipt and in tests.
        is_delta: whether it reflects into a single direction. Directions that are drawn from any other density never
            have this direction. Then ``eval`` and ``pdf`` are 0, and ``weight`` is the weight of its sample.
        transmits: whether it lets light through, so that ``sample`` may return a w_i below the horizon of n. Then
            ``material.Ni`` is the index of refraction behind the surface divided by that on the viewer's side.
        is_reciprocal: whether f_r(w_o, w_i) = f_r(w_i, w_o). The contract tests check it.
        reaches_all: whether ``pdf`` is positive for every w_i in which f_r max(n·ω_i, 0) is. If it is so for all BRDFs
            of a scene, samples of the lights may leave out what ``sample`` finds: see ``lights.environment_light``. The
            contract tests check it.
        has_microfacets: whether the estimator ``microfacet`` may take it where a material has both Ns and a roughness.
        needs: the material that calls for it, for the receipt: "no triangle has *a material with Ns > 1*".
        parameters: name → default (a number or three numbers) of each value that it reads from the MTL file in addition
            to the usual keys. In kernels they are members of ``material``: ``parameters = {"roughness": 0.5}`` makes
            ``material.roughness``.
    """

    required = ("describes", "eval", "pdf", "sample")
    kind, name, is_delta, transmits, is_reciprocal = "BRDF", "", False, False, True
    reaches_all, has_microfacets = False, True
    needs = "a material for it"
    parameters: dict[str, float | tuple[float, float, float]] = {}

    def describes(self, material: Any, dtype: type) -> bool:
        """Whether this BRDF describes a ``Material``. If several do, the one that was registered last is used.

        Args:
            dtype: the numpy type of the running precision.
        """
        raise NotImplementedError(f"{type(self).__name__} must say which materials it describes")

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """f_r, a vec3 per steradian, without the cosine."""
        ti.static_assert(False, "a BRDF must say what eval(self, material, w_o, w_i, n) is")

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """The density of ``sample`` at w_i, per solid angle."""
        ti.static_assert(False, "a BRDF must say what pdf(self, material, w_o, w_i, n) is")

    @ti.func
    def sample(self, material, w_o, n, xi):
        """w_i, made of the two uniform random numbers ``xi`` in [0, 1)²."""
        ti.static_assert(False, "a BRDF must say what sample(self, material, w_o, n, xi) is")

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """f_r max(n·ω_i, 0) / pdf of a w_i that ``sample`` returned.

        If terms cancel, a subclass should override this method with the cancelled formula: for narrow lobes, the
        quotient is 0/0 (C-3).
        """
        return eval_over_pdf(self, material, w_o, w_i, n)

    @compile_time
    def sample_weight(self, material, w_o, w_i, n):
        """The weight for integrators: ``weight``; or a quotient, if ``eval`` or ``pdf`` is newer than ``weight``."""
        return self.weight(material, w_o, w_i, n) if owns_weight(self) else eval_over_pdf(self, material, w_o, w_i, n)


@ti.data_oriented
@overridable()
class DeltaBrdf(Brdf):
    """A BRDF that reflects into single directions. A subclass defines ``sample`` and ``weight``."""

    is_delta = reaches_all = True

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """0, because a direction from any other source than ``sample`` is never exactly that of a sample."""
        return tm.vec3(0)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """0, for the same reason as ``eval``."""
        return 0.0


@ti.func
def eval_over_pdf(brdf: ti.template(), material, w_o, w_i, n):
    """f_r max(n·ω_i, 0) / pdf as a quotient; 0 where the pdf is 0, as on the horizon, which ξ = 0 can give."""
    f_cos = brdf.eval(material, w_o, w_i, n) * ti.max(0.0, tm.dot(n, w_i))
    pdf = brdf.pdf(material, w_o, w_i, n)
    return ti.select(pdf == 0, tm.vec3(0), f_cos / pdf)


def owns_weight(brdf: Brdf) -> bool:
    """Whether ``weight`` was defined together with, or after, the ``eval`` and the ``pdf`` of this object."""
    names = replaced(brdf)
    if "weight" not in names and {"eval", "pdf"} & set(names):
        return False
    order = type(brdf).__mro__
    rank = {name: next(i for i, cls in enumerate(order) if name in vars(cls)) for name in ("eval", "pdf", "weight")}
    return rank["weight"] <= min(rank["eval"], rank["pdf"])


# ── the names of the handouts ──


@ti.data_oriented
@overridable()
class HandoutBrdf(Brdf):
    """What integrators ask, in the words of the handouts: methods that need no ``self``, nor random numbers.

    Such a class takes the place of the package's own BRDFs as soon as one of its methods is replaced. A subclass
    defines ``sample_direction``, ``evaluate_probability``, ``evaluate_brdf`` and ``evaluate_brdf_factor``.
    """

    other_arguments: dict[str, Exception] = {}  # methods of a course's class in whose place the package's run

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """``evaluate_brdf``."""
        return call_with_known_args(self.evaluate_brdf, material, w_o, w_i, n)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """``evaluate_probability``."""
        return call_with_known_args(self.evaluate_probability, material, w_o, w_i, n)

    @ti.func
    def sample(self, material, w_o, n, xi):
        """``sample_direction``."""
        return call_with_known_args(self.sample_direction, material, w_o, n, xi=xi)

    @compile_time
    def weight(self, material, w_o, w_i, n):
        """``evaluate_brdf_factor``; or f_r cos θ_i / pdf, if only f_r or the pdf was replaced."""
        if self.has_own_factor():
            return call_with_known_args(self.evaluate_brdf_factor, material, w_o, w_i, n)
        return eval_over_pdf(self, material, w_o, w_i, n)

    def has_own_factor(self) -> bool:
        """Whether the weight of a sample is ``evaluate_brdf_factor``, and not the quotient f_r cos θ_i / pdf.

        It is the quotient where f_r and the pdf are written, and the factor is not.
        """
        names, cannot_run = {*replaced(self), *self.other_arguments}, set(unfinished(self))
        if "evaluate_brdf_factor" in names - cannot_run:
            return True
        quotient = {"evaluate_brdf", "evaluate_probability"}
        return not quotient & names or bool(quotient & cannot_run)
