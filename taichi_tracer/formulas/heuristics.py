"""How two densities share one direction: the heuristics of multiple importance sampling.

Veach & Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995, sections 3 and 4.
"""

import taichi as ti


@ti.func
def heuristic(pdf, other, exponent: ti.template()):
    """pdf^β / (pdf^β + other^β), computed as 1/(1 + r^β) with r = other/pdf, which does not overflow; 0 if pdf is 0.

    Args:
        exponent: β: 2 for the power heuristic, 1 for the balance heuristic.
    """
    ratio = other / pdf
    if ti.static(exponent == 2):
        ratio = ratio * ratio
    return ti.select(pdf > 0, 1 / (1 + ratio), 0.0)
