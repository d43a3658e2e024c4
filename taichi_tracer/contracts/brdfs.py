"""What every BRDF must do: a density that is that of its samples, the light of one sample, reciprocity, energy.

All directions leave the surface and have unit length. Each check takes the ``Bench`` of a BRDF and tries every material
of ``trial_materials`` that it describes, with viewers from right above to grazing, about normals in several directions.
"""

import numpy as np
import taichi as ti

from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.contracts.lab import WHOLE, Rows, bound
from taichi_tracer.contracts.statistics import (
    CORNERS,
    check_density,
    check_near,
    check_range,
    check_unit,
    directions_everywhere,
    sidak,
    uniform_pairs,
)
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.system import runtime

SAMPLES = 50_000
NORMALS = np.array([[0, 0, 1], [0, 0, -1], [0.6, -0.48, 0.64]])
COSINES = (1.0, 0.7, 0.25, 0.02)  # of the viewer's angle with the normal
ENERGY_TOLERANCE = 1e-2  # of ∫ f cos dω ≤ 1, that of the quadrature included
# f32 rounds a direction by 6e-8. In the narrowest lobes of the trial materials, 1e-2 wide, that moves a value by 1e-4.
VALUE_TOLERANCE = 1e-3


def trial_materials(brdf):
    """Materials for a BRDF: the usual keys of MTL files, and its own parameters."""
    yield from (Material(Kd=(0.8, 0.5, 0.2), Ns=ns) for ns in (0.0, 1.5, 10.0, 100.0, 1e4, 1e21))
    yield Material(Kd=(1.0, 1.0, 1.0), Ns=1.0)
    yield Material(alpha_x=1e-9, alpha_y=1e-9, F0=(0.9, 0.6, 0.3))
    for alpha_x, alpha_y in ((0.5, 0.5), (0.1, 0.4)):
        yield Material(Kd=(0.3, 0.3, 0.3), Ks=(0.5, 0.5, 0.5), alpha_x=alpha_x, alpha_y=alpha_y, F0=(0.9, 0.6, 0.3))
        layer = {"alpha_x": alpha_x, "alpha_y": alpha_y, "extra": {LAYERED: (1.0,)}}
        yield Material(Kd=(0.9, 0.5, 0.1), F0=(0.04, 0.04, 0.04), **layer)
        yield Material(Kd=(0.45, 0.25, 0.05), F0=(0.47, 0.27, 0.07), **layer)  # half a metal
    for factor in (1.0, 0.5, 0.25) if brdf.parameters else ():
        extra = {name.lower(): tuple(factor * np.atleast_1d(value)) for name, value in brdf.parameters.items()}
        yield Material(Kd=(0.9, 0.6, 0.3), Ks=(0.9, 0.6, 0.3), extra=extra)


def described_materials(brdf):
    """Those of the trial materials that a BRDF describes."""
    return [material for material in trial_materials(brdf) if brdf.describes(material, runtime.dtype())]


class Bench:
    """A BRDF and some materials, usually those that it describes, asked from Python. Directions are (N, 3) arrays."""

    def __init__(self, brdf, materials=None):
        self.brdf, self.materials = brdf, described_materials(brdf) if materials is None else materials
        self.library = MaterialLibrary(self.materials, [brdf])
        # which, w_o, n, (N, 2) ξ → (N, 3) directions; which, w_o, n, w_i → f_r (N, 3), pdf (N,), weight (N, 3)
        self.sample = Rows(bound(sampled, brdf, self.library), [WHOLE, 3, 3, 2], [3])
        self.values = Rows(bound(values, brdf, self.library), [WHOLE, 3, 3, 3], [3, 1, 3])

    def cases(self):
        """(number of the material, w_o, n, what to say of it), each combination once."""
        usual = vars(Material())
        for which, material in enumerate(self.materials):
            numbers = ", ".join(f"{k}={v}" for k, v in vars(material).items() if v != usual[k])
            for n in NORMALS:
                for cosine in COSINES:
                    yield which, viewer(n, cosine), n, f"{self.brdf.name}: {numbers}, n = {n}, n·w_o = {cosine}"


@ti.func
def sampled(brdf: ti.template(), library: ti.template(), which, w_o, n, xi):
    """A direction, of material number ``which``."""
    return brdf.sample(library.get(which), w_o, n, xi)


@ti.func
def values(brdf: ti.template(), library: ti.template(), which, w_o, n, w_i):
    """f_r, pdf, and the weight of w_i as if it were a sample."""
    material = library.get(which)
    f, pdf = brdf.eval(material, w_o, w_i, n), brdf.pdf(material, w_o, w_i, n)
    return f, pdf, brdf.sample_weight(material, w_o, w_i, n)


def at(n, name, direction):
    """A direction for a message, with its cosine."""
    return f"n·{name} = {n @ direction:.4g}, {name} = {np.round(direction, 4).tolist()}"


def check_each(what, holds, n, w_i, values):
    """Raise an AssertionError with the first of (N, 3) directions for which something does not hold, and its value."""
    wrong = np.flatnonzero(~np.reshape(holds, (len(w_i), -1)).all(axis=1))
    assert len(wrong) == 0, f"{what} {values[wrong[0]]} at {at(n, 'w_i', w_i[wrong[0]])}"


def viewer(n, cosine):
    """A unit vector at an angle from n, to a side that is no axis."""
    side = np.cross(n, [0.3, 0.8, -0.2])
    side /= np.linalg.norm(side)
    return cosine * n + np.sqrt(1 - cosine**2) * side


# ── the checks ──


def steps(brdf):
    """The checks of a BRDF, in the order in which a mistake is looked for."""
    if brdf.is_delta:
        return (check_delta,)
    usual = check_values_are_finite, check_sample_follows_pdf
    return (*usual, check_reciprocity) if brdf.is_reciprocal else usual


def check_sample_follows_pdf(bench):
    """The samples are those of pdf, ∫ pdf = 1, weight = f cos/pdf, and ∫ f cos is at most 1, and what samples find.

    The level of each χ² is that of ``sidak`` for all of them together.
    """
    cases = list(bench.cases())
    for i, (which, w_o, n, what) in enumerate(cases):

        def draw(xi, which=which, w_o=w_o, n=n):
            return bench.sample(which, w_o, n, xi)

        def pdf_and_f_cos(directions, which=which, w_o=w_o, n=n):
            f, pdf, _ = bench.values(which, w_o, n, directions)
            return np.column_stack([pdf, f * np.maximum(directions @ n, 0)[:, None]])

        w_i, (_, *albedo) = check_density(what, draw, pdf_and_f_cos, SAMPLES, sidak(len(cases)), seed=i)

        f, pdf, weight = bench.values(which, w_o, n, w_i)
        f_cos = f * np.maximum(w_i @ n, 0)[:, None]
        quotient = f_cos / np.maximum(pdf, 1e-30)[:, None]
        resolvable = (pdf > 1e-6 * pdf.max()) & (np.abs(w_i @ n) > 1e-4)
        error = np.abs(weight - quotient) / (1e-3 + np.abs(quotient))
        same = (error < VALUE_TOLERANCE) | ~resolvable[:, None]
        check_each(f"{what}: weight is not f cos/pdf: off by", same, n, w_i, error)

        assert max(albedo) < 1 + ENERGY_TOLERANCE, f"{what}: reflects {max(albedo):.4f} of the light"
        spread = weight.std(axis=0) / np.sqrt(SAMPLES)
        off = np.abs(weight.mean(axis=0) - albedo) - 5 * spread
        assert (off < ENERGY_TOLERANCE * np.array(albedo) + 1e-4).all(), (
            f"{what}: samples are worth {weight.mean(axis=0)}, but the integral of f cos is {albedo}"
        )


def check_values_are_finite(bench):
    """f_r, pdf, samples and weights are finite, and none is negative, on either side of the horizon."""
    xi, around = np.concatenate([CORNERS, [[0.5, 0]], uniform_pairs(200, seed=5)]), directions_everywhere(500)
    for which, w_o, n, what in bench.cases():
        horizon, mirrored = viewer(n, 0.0), 2 * (n @ w_o) * n - w_o
        special = np.array([n, -n, w_o, -w_o, mirrored, -mirrored, horizon, -horizon, viewer(n, 1e-7)])
        # Where the normal is interpolated, a viewer may stand a little below its horizon.
        for viewed in (w_o, horizon, viewer(n, -0.05)):
            sampled = bench.sample(which, viewed, n, xi)
            check_range(f"{what}: a direction that sample returns", sampled)
            w_i = np.concatenate([sampled, special, around])
            f, pdf, weight = bench.values(which, viewed, n, w_i)
            asked = f"{what.partition(', n·w_o')[0]}, {at(n, 'w_o', viewed)}"
            for name, value in (("eval", f), ("pdf", pdf), ("weight", weight[: len(sampled)])):
                check_each(f"{asked}: {name} is", np.isfinite(value) & (value >= 0), n, w_i[: len(value)], value)


def check_reciprocity(bench):
    """f_r(w_o, w_i) = f_r(w_i, w_o) above the horizon."""
    for which, w_o, n, what in bench.cases():
        w_i = np.concatenate([bench.sample(which, w_o, n, uniform_pairs(500, seed=7)), directions_everywhere(500)])
        w_i = w_i[w_i @ n > 1e-3]
        there, back = bench.values(which, w_o, n, w_i)[0], bench.values(which, w_i, n, np.tile(w_o, (len(w_i), 1)))[0]
        difference = np.abs(there - back) / (np.maximum(there, back) + 1e-2 * there.max() + 1e-12)
        check_each(f"{what}: f_r is not reciprocal: off by", difference < 5 * VALUE_TOLERANCE, n, w_i, difference)


def check_delta(bench):
    """One direction whatever ξ, which turns back into w_o; eval and pdf are 0; no more light leaves than arrives."""
    for which, w_o, n, what in bench.cases():
        w_i = bench.sample(which, w_o, n, uniform_pairs(50, seed=1))
        check_near(f"{what}: a delta BRDF has one direction", w_i, w_i[0], 0)
        check_unit(what, w_i)
        f, pdf, weight = bench.values(which, w_o, n, np.concatenate([w_i[:1], directions_everywhere(500)]))
        assert not f.any(), f"{what}: eval of a delta BRDF is 0"
        assert not pdf.any(), f"{what}: pdf of a delta BRDF is 0"
        check_range(f"{what}: weight", weight[0], 0, 1 + 1e-5)
        if bench.brdf.is_reciprocal:
            back = bench.sample(which, w_i[0], n, uniform_pairs(1, seed=1))[0]
            check_near(f"{what}: {w_i[0]} does not reflect back into w_o, but into {back}", back, w_o, 1e-5)
