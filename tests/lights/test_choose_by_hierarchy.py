"""Cones around the normals of lamps: the joint of two contains both, and is no larger than it must be."""

import numpy as np

from taichi_tracer.formulas.luminance import luminance
from taichi_tracer.lights.choose_by_hierarchy import joined_cones


def test_a_joined_cone_contains_both_and_is_the_smallest(rng):
    n = 2000
    axes = rng.normal(size=(2, n, 3))
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    angles = rng.uniform(0, 2, (2, n)) * rng.choice([0.05, 1.0], (2, n))
    axis, joined = joined_cones(axes[0], angles[0], axes[1], angles[1])
    between = [np.arccos(np.clip((axis * one).sum(axis=1), -1, 1)) for one in axes]
    for k in range(2):
        assert (np.minimum(between[k] + angles[k], np.pi) <= joined + 1e-6).all()
    apart = np.arccos(np.clip((axes[0] * axes[1]).sum(axis=1), -1, 1))
    smallest = np.maximum(angles.max(axis=0), np.minimum((angles.sum(axis=0) + apart) / 2, np.pi))
    np.testing.assert_allclose(joined, smallest, atol=1e-6)


def test_a_luminance_is_that_of_srgb_and_never_0_where_there_is_light():
    found = luminance(np.array([[1.0, 1, 1], [0, 2, 0], [0, 0, 1e-3], [0, 0, 0], [5e-5, 0, -5e-5]]))
    np.testing.assert_allclose(found[:4], [1, 2 * 0.7152, 0.0722e-3, 0], rtol=1e-12)
    assert found[4] > 0
