"""BRDFs by the names of the handouts: functions without ``self``, which draw their random numbers themselves.

A class with these names takes the place of the package's own BRDFs as soon as one of its methods is replaced.
"""

import taichi as ti

from taichi_tracer.brdfs.base import Brdf, eval_over_pdf
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.parts import call_with_known_args, overridable, replaced, unfinished


@ti.data_oriented
@overridable()
class HandoutBrdf(Brdf):
    """What integrators ask, in the words of the handouts.

    A subclass defines ``sample_direction``, ``evaluate_probability``, ``evaluate_brdf`` and ``evaluate_brdf_factor``.
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
