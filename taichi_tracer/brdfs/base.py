"""What a BRDF is: a density that its directions are drawn from, and the light that it sends from w_i to w_o.

Conventions, the same for every BRDF: all directions have unit length and leave the surface, w_o to the viewer and w_i
to the light, in world space. n is the shading normal on the viewer's side. f_r is without the cosine. Densities are per
solid angle. A w_i below the horizon of n reflects nothing; the horizon of the triangle's plane is the integrators' to
check.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.system.seams import replaced, seams


@ti.data_oriented
@seams("eval", "pdf", "sample", "weight")
class Brdf:
    """The interface. A subclass says which materials it describes, ``eval``, ``pdf`` and ``sample``.

    Attributes:
        name: what registry, receipt and tests call it.
        is_delta: whether it reflects into a single direction, which no other density than its own ever meets. Then
            ``eval`` and ``pdf`` are 0, and ``weight`` says what its sample is worth.
        is_reciprocal: whether f_r(w_o, w_i) = f_r(w_i, w_o): the contract tests hold it to that.
        needs: for the receipt, which material calls for it, as in "no triangle has *a material with Ns > 1*".
        parameters: name → default, a number or three, of what it reads from the MTL file beside the usual keys. In
            kernels they are members of ``material``: ``parameters = {"roughness": 0.5}`` and ``material.roughness``.
    """

    kind, name, is_delta, is_reciprocal = "BRDF", "", False, True
    needs = "a material for it"
    parameters: dict[str, float | tuple[float, float, float]] = {}

    def describes(self, material, dtype: type) -> bool:
        """Whether a ``Material`` is reflected by this BRDF. Of several, the one that was registered last is taken.

        Args:
            dtype: the numpy type of the running precision.
        """
        raise NotImplementedError(f"{type(self).__name__} must say which materials it describes")

    @ti.func
    def eval(self, material, w_o, w_i, n):
        """f_r, a vec3 per steradian, without the cosine."""
        ti.static_assert(False, "a BRDF must say what eval(self, material, w_o, w_i, n) is")
        return tm.vec3(0)

    @ti.func
    def pdf(self, material, w_o, w_i, n):
        """The density of ``sample`` at w_i, per solid angle."""
        ti.static_assert(False, "a BRDF must say what pdf(self, material, w_o, w_i, n) is")
        return 0.0

    @ti.func
    def sample(self, material, w_o, n, xi):
        """w_i, made of the two uniform numbers ``xi`` in [0, 1)²."""
        ti.static_assert(False, "a BRDF must say what sample(self, material, w_o, n, xi) is")
        return n

    @ti.func
    def weight(self, material, w_o, w_i, n):
        """f_r max(n·ω_i, 0) / pdf of a w_i that ``sample`` returned.

        Where terms cancel, a subclass does better to cancel them: for narrow lobes the quotient is 0/0 (C-3).
        """
        return eval_over_pdf(self, material, w_o, w_i, n)

    @ti.func
    def sample_weight(self, material, w_o, w_i, n):
        """What integrators ask: ``weight``, unless it belongs to another ``eval`` or ``pdf`` than this class has."""
        value = tm.vec3(0)
        if ti.static(owns_weight(self)):
            value = self.weight(material, w_o, w_i, n)
        else:
            value = eval_over_pdf(self, material, w_o, w_i, n)
        return value


@ti.func
def eval_over_pdf(brdf: ti.template(), material, w_o, w_i, n):
    """f_r max(n·ω_i, 0) / pdf as a quotient; 0 where the pdf is 0, as on the horizon, which ξ = 0 meets."""
    f_cos = brdf.eval(material, w_o, w_i, n) * ti.max(0.0, tm.dot(n, w_i))
    pdf = brdf.pdf(material, w_o, w_i, n)
    return ti.select(pdf == 0, tm.vec3(0), f_cos / pdf)


def owns_weight(brdf: Brdf) -> bool:
    """Whether ``weight`` was written with, or after, the ``eval`` and the ``pdf`` that this object has."""
    names = replaced(brdf)
    if "weight" not in names and {"eval", "pdf"} & set(names):
        return False
    order = type(brdf).__mro__
    rank = {name: next(i for i, cls in enumerate(order) if name in vars(cls)) for name in ("eval", "pdf", "weight")}
    return rank["weight"] <= min(rank["eval"], rank["pdf"])
