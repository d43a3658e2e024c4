"""The rough conductor of the handout (A2-11, A2-12), in float64, as it is printed there: nothing is cancelled.

Directions are (n, 3) in the frame of the surface: z is along the normal. alpha is (α_x, α_y).
"""

import numpy as np


def distribution(alpha, m):
    """D(ω_m) by the angles of ω_m."""
    cos_squared = m[:, 2] ** 2
    tan_squared = (1 - cos_squared) / cos_squared
    phi = np.arctan2(m[:, 1], m[:, 0])
    e = tan_squared * (np.cos(phi) ** 2 / alpha[0] ** 2 + np.sin(phi) ** 2 / alpha[1] ** 2)
    return 1 / (np.pi * alpha[0] * alpha[1] * cos_squared**2 * (1 + e) ** 2)


def masking(alpha, w):
    """Λ(ω)."""
    cos_squared = w[:, 2] ** 2
    tan_squared = (1 - cos_squared) / cos_squared
    phi = np.arctan2(w[:, 1], w[:, 0])
    alpha_squared = alpha[0] ** 2 * np.cos(phi) ** 2 + alpha[1] ** 2 * np.sin(phi) ** 2
    return (np.sqrt(1 + alpha_squared * tan_squared) - 1) / 2


def parts(alpha, F0, w_o, w_i):
    """(f_r, pdf, weight) of pairs of directions above the surface."""
    m = w_o + w_i
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    D, cosine = distribution(alpha, m), (w_o * m).sum(axis=1)
    G = 1 / (1 + masking(alpha, w_o) + masking(alpha, w_i))
    G1 = 1 / (1 + masking(alpha, w_o))
    F = np.asarray(F0) + (1 - np.asarray(F0)) * (1 - cosine[:, None]) ** 5
    f_r = F * (D * G / (4 * w_o[:, 2] * w_i[:, 2]))[:, None]
    visible = G1 * D * cosine / w_o[:, 2]
    return f_r, visible / (4 * cosine), F * (G / G1)[:, None]
