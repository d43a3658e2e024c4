"""Closed forms of light from surfaces, in float64 numpy."""

import numpy as np


def polygon_irradiance(point, normal, corners):
    """E / L of a uniform polygon that lies above the horizon of the point: Lambert's formula, 1760.

    Args:
        point, normal: (3,). corners: (n, 3), counter-clockwise as seen from the point.
    """
    to = np.asarray(corners, float) - point
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    following = np.roll(to, -1, axis=0)
    cross = np.cross(to, following)
    length = np.linalg.norm(cross, axis=1)
    angle = np.arctan2(length, (to * following).sum(axis=1))
    return abs((angle * (cross @ normal) / length).sum()) / 2


def clipped(point, normal, corners):
    """The part of a polygon that lies above the horizon of a point (Sutherland & Hodgman 1974)."""
    height = (np.asarray(corners, float) - point) @ normal
    found = []
    for i, corner in enumerate(corners):
        j = (i + 1) % len(corners)
        if height[i] >= 0:
            found.append(corner)
        if height[i] * height[j] < 0:
            found.append(corner + (corners[j] - corner) * (height[i] / (height[i] - height[j])))
    return np.array(found).reshape(-1, 3)


def room_radiance(emission, albedo, max_bounces):
    """Radiance in a closed room whose surfaces all emit and reflect the same: a geometric sum."""
    return emission * sum(albedo**k for k in range(max_bounces + 1))
