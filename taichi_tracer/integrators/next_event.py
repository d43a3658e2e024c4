"""Light at a surface, from the lights' side and from the surface's side: the two steps of every estimator.

Direct light and paths are made of these two steps. Both know two densities: that of the lights, with which
``scene.lights.sample`` finds a direction, and that of the BRDF. Where both steps can find the same light, the caller
multiplies each by a heuristic of the two densities; the sum is then unbiased (Veach & Guibas 1995).
"""

import taichi as ti
import taichi.math as tm


@ti.func
def sample_of_lights(scene: ti.template(), surface, xi):
    """(f_r cos θ, L, pdf of the lights, pdf of the BRDF) of a direction that is drawn from the lights.

    L is 0 if something blocks the light. For a mirror, f_r cos θ is always 0: only its own direction finds light. If
    all surfaces of the scene are mirrors, no sample is taken.
    """
    f_cos, light, pdf, pdf_brdf = tm.vec3(0), tm.vec3(0), 1.0, 0.0
    if ti.static(scene.samples_lights):
        w_i, distance, unblocked, pdf_lights = scene.lights.sample(surface.origin, surface.normal, xi)
        pdf, pdf_brdf = pdf_lights, surface.pdf(w_i)
        if unblocked.max() > 0 and tm.dot(surface.geometric_normal, w_i) > 0:
            f_cos = surface.eval_cosine(w_i)
            if f_cos.max() > 0:
                if not scene.is_blocked(surface, w_i, distance):
                    light = unblocked
    return f_cos, light, pdf, pdf_brdf


@ti.func
def light_along(scene: ti.template(), surface, w_i, factor):
    """(L, pdf of the lights) of the light that arrives at a surface from the direction w_i without any reflection.

    The caller multiplies L by ``factor``. If ``factor`` is 0, no ray is sent, and L is 0.
    """
    light, hit = scene.visible(surface, w_i, factor)
    pdf = 0.0
    if ti.static(scene.samples_lights):
        pdf = scene.lights.pdf(surface.origin, surface.normal, w_i, hit)
    return light, pdf


@ti.func
def pairs(scene: ti.template(), rng):
    """(ξ for the BRDF, ξ for the lights) of an estimator that samples both.

    The pair that is even together with the point in the pixel goes to lamps, if the scene has some, because near lamps
    make most of the noise; otherwise to the BRDF.
    """
    xi_brdf, xi_light = rng.next_2d_of_term(), rng.next_2d()
    if ti.static(scene.lights.has_lamps):
        xi_brdf, xi_light = xi_light, xi_brdf
    return xi_brdf, xi_light
