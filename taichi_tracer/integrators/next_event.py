"""One sample of the light that a surface reflects, from the lights' side and from the surface's side.

Direct light and paths are made of these two steps. Both know two densities: that of the lights, with which
``scene.lights.sample`` finds a direction, and that of the BRDF. Where both steps can find the same light, the caller
multiplies each by a heuristic of the two densities; the sum is then unbiased (Veach & Guibas 1995).
"""

import taichi as ti
import taichi.math as tm


@ti.func
def sample_of_lights(scene: ti.template(), surface, rng):
    """(f_r cos θ L / pdf, pdf of the lights, pdf of the BRDF) of a direction that is drawn from the lights.

    The value is 0 if something blocks the light. For a mirror it is always 0: only its own direction finds light. If
    all surfaces of the scene are mirrors, no sample is taken.
    """
    value, pdf, pdf_brdf = tm.vec3(0), 1.0, 0.0
    if ti.static(scene.effects.samples_lights):
        w_i, distance, light, pdf_lights = scene.lights.sample(surface.origin, surface.normal, rng.next_2d_of_term())
        pdf, pdf_brdf = pdf_lights, surface.pdf(w_i)
        if light.max() > 0 and tm.dot(surface.geometric_normal, w_i) > 0:
            value = surface.eval_cosine(w_i) * light / pdf
            if value.max() > 0:
                if scene.is_blocked(surface, w_i, distance):
                    value = tm.vec3(0)
    else:
        rng.skip_2d_of_term()
    return value, pdf, pdf_brdf


@ti.func
def light_along(scene: ti.template(), surface, w_i, knows_pdf: ti.template()):
    """(L, pdf of the lights) of the light that arrives at a surface from the direction w_i without any reflection.

    Args:
        knows_pdf: whether the pdf is asked for; otherwise it is 0, and no tables are read.
    """
    light, pdf = tm.vec3(0), 0.0
    if surface.lets_pass(w_i):
        ray = surface.ray_along(w_i)
        hit = scene.met(surface, ray)
        light = scene.lights.arriving(ray, hit)
        if ti.static(knows_pdf and scene.effects.samples_lights):
            pdf = scene.lights.pdf(surface.origin, surface.normal, w_i, hit)
    return light, pdf
