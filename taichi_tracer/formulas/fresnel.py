"""Light at a smooth surface between two media: how much is reflected, and where the rest goes."""

import taichi as ti

from taichi_tracer.formulas import vector_math as tm


@ti.func
def fresnel_dielectric(cosine, eta):
    """The reflected share of unpolarised light (Born & Wolf, Principles of Optics, 7th edition, section 1.5.2).

    Args:
        cosine: n·ω_o, at least 0.
        eta: the index of refraction behind the surface divided by that on the side of ω_o.
    """
    sine_squared = (1 - cosine * cosine) / (eta * eta)
    share = 1.0  # total reflection
    if sine_squared < 1:
        behind = ti.sqrt(1 - sine_squared)
        parallel = (eta * cosine - behind) / (eta * cosine + behind)
        perpendicular = (cosine - eta * behind) / (cosine + eta * behind)
        share = (parallel * parallel + perpendicular * perpendicular) / 2
    return share


@ti.func
def refracted(w_o, n, cosine, eta):
    """The direction behind the surface, by Snell's law: sin θ_o = η sin θ_t. All vectors have unit length.

    Args:
        cosine: n·ω_o. eta: as in ``fresnel_dielectric``, which must be less than 1 there.
    """
    behind = ti.sqrt(ti.max(0.0, 1 - (1 - cosine * cosine) / (eta * eta)))
    return tm.normalize((cosine / eta - behind) * n - w_o / eta)
