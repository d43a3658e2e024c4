"""The primitives of a leaf in lanes of rays: what is special about single primitives, and both precisions."""

import numpy as np
import pytest
from shadows import Asking, check
from shapes import random_spheres, soup, with_spheres

import taichi_tracer as tt
from taichi_tracer.fast.shadow_lanes import ShadowLanes
from taichi_tracer.geometry import Mesh


@pytest.mark.exhaustive
def test_spheres_and_triangles_in_both_precisions(precision):
    rng = np.random.default_rng(2)
    check(with_spheres(random_spheres(rng, 4), *soup(rng, 4, 2.0)), ShadowLanes)


@pytest.mark.long
def test_rays_that_leave_a_sphere_do_not_meet_it_and_rays_from_inside_do(f32):
    scene = tt.SceneData(with_spheres([[0, 0, 0, 1.0], [3, 0, 0, 1.0]]))
    rng = np.random.default_rng(3)
    n = rng.normal(size=(400, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    d = rng.normal(size=(400, 3))
    d *= np.sign((d * n).sum(axis=1))[:, None]
    outwards = Asking(scene.ray_intersector, n * (1 + 1e-6), d)
    alone, together = outwards.answers()
    np.testing.assert_array_equal(together, alone)
    towards_other = (n + d / np.linalg.norm(d, axis=1, keepdims=True))[:, 0] > 1.5
    assert 0 < together.sum() < 400
    assert together[~towards_other].mean() < 0.1
    alone, together = Asking(scene.ray_intersector, n * (1 - 1e-6), d).answers()
    np.testing.assert_array_equal(together, alone)
    assert Asking(scene.ray_intersector, n * 0.5, d).answers()[1].all()


@pytest.mark.long
def test_triangles_with_backface_culling(f32):
    rng = np.random.default_rng(4)
    vertices, faces = soup(rng, 5, 2.0)
    mesh = with_spheres(random_spheres(rng, 2), vertices, faces, face_culls=np.arange(5) % 2 == 0)
    check(mesh, ShadowLanes)
    check(Mesh(vertices, faces, face_culls=np.arange(5) % 2 == 0), ShadowLanes)
