"""Reflection and environments in float64, from A2-4, A2-5 and C-1."""

import numpy as np


def phong_albedo(cosine, exponent, n=400):
    """∫ (α+1)/(2π) max(0, ω_r·ω)^α max(0, n·ω) dω for a viewer at an angle from n, by quadrature about ω_r."""
    z = 1 - (np.arange(n) + 0.5) / n
    # Equal shares of the lobe: ω_r·ω = z^(1/(α+1)).
    c = z ** (1 / (exponent + 1))
    s = np.sqrt(1 - c * c)
    phi = 2 * np.pi * (np.arange(n) + 0.5) / n
    cosine = np.atleast_1d(cosine)[:, None, None]
    sine = np.sqrt(1 - cosine**2)
    n_dot_w = c[None, :, None] * cosine + s[None, :, None] * np.cos(phi)[None, None, :] * sine
    return np.maximum(n_dot_w, 0).mean(axis=(1, 2))


def lookup(image, directions):
    """Nearest texel of unit directions: u = 1/2 + atan2(z, x)/2π from the left, v = 1/2 + asin(y)/π from the bottom."""
    h, w = image.shape[:2]
    d = np.asarray(directions, np.float64)
    u = 0.5 + np.arctan2(d[:, 2], d[:, 0]) / (2 * np.pi)
    v = 0.5 + np.arcsin(np.clip(d[:, 1], -1, 1)) / np.pi
    column = np.floor(u * w).astype(int) % w
    row = np.clip(np.floor((1 - v) * h).astype(int), 0, h - 1)
    return image[row, column]


def to_unit(d):
    """Rows of unit length."""
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def sphere(rng, count):
    """(count, 3) directions, uniform on the sphere."""
    return to_unit(rng.normal(size=(count, 3)))


def hemisphere(rng, count):
    """(count, 3) directions, uniform on the hemisphere about +z."""
    directions = sphere(rng, count)
    directions[:, 2] = np.abs(directions[:, 2])
    return directions
