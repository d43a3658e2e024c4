"""Caustics: what rays from the lamps say of them, against formulas and against long renders."""

import math

import numpy as np
import pytest
from unseen_scenes import KD, KE, SIZE, VIEW, flat, scene, upright

from taichi_tracer.camera import make_camera
from taichi_tracer.unseen.caustics import caustics, has_caustics
from taichi_tracer.unseen.mirror_chains import OF_FEW_RAYS, follow

HALF = 0.02


def caustics_of(made, max_bounces=5, **view) -> np.ndarray:
    """The caustics of a view."""
    camera = make_camera(SIZE, SIZE, **{**VIEW, **view})
    return caustics(made.in_kernels(), made, camera, (0, SIZE, 0, SIZE), max_bounces)


@pytest.mark.parametrize("view", [{}, {"projection": "orthographic", "fov": None, "screen_window": (-1, 1, -1, 1)}])
def test_a_mirror_shows_the_floor_a_second_lamp(view):
    """A small lamp at the height 1 before an upright mirror: the floor is lit by its image behind the mirror, which
    reflects the cosine of the angle at it."""
    lamp = np.array([0.0, 1.0, 0.0])
    turned = upright(0, HALF) + lamp - [0, HALF, 0]
    made = scene([flat((0, 0, 0), 6), turned, upright(1.5, 3, -1.0)], [0, 1, 2])
    found = caustics_of(made, **view)
    camera = make_camera(SIZE, SIZE, **{**VIEW, **view})
    y, x = np.mgrid[:SIZE, :SIZE]
    origins, directions = camera.rays(x.ravel(), y.ravel())
    points = origins - directions * (origins[:, 1:2] / directions[:, 1:2])
    image = np.array([3.0, 1.0, 0.0])
    to = image - points
    r = np.linalg.norm(to, axis=1)
    irradiance = KE * (2 * HALF) ** 2 * abs(to[:, 0]) / r * abs(to[:, 1]) / r / r**2
    right = np.where(points[:, 0] < 1.5, KD / math.pi * irradiance * abs(to[:, 0]) / r, 0)
    got = np.bincount(found[:, 0].astype(int), found[:, 2] / OF_FEW_RAYS, SIZE * SIZE)
    hit = made.intersect(origins, directions).material_id == 0
    assert got[hit].sum() == pytest.approx(right[hit].sum(), rel=0.04)
    both = np.where(hit, got, 0), np.where(hit, right, 0)
    blocks = [one.reshape(SIZE // 8, 8, SIZE // 8, 8).sum(axis=(1, 3)) for one in both]
    np.testing.assert_allclose(*blocks, rtol=0.3, atol=0.05 * blocks[1].max())
    chance = np.bincount(found[:, 0].astype(int), found[:, 1], SIZE * SIZE)
    lit = (got > 0.2 * got.max()) & hit
    mirrored = (abs(to[:, 0]) / r)[lit]
    np.testing.assert_allclose(chance[lit], got[lit] / (KD * mirrored * KE), rtol=0.1)
    made.destroy()


def test_where_caustics_can_be_missed():
    floor, lamp, mirror = flat((0, 0, 0), 4), flat((0, 3, 0), 0.01, -1.0), upright(1.5, 1, -1.0)
    with_all, without_mirror = scene([floor, lamp, mirror], [0, 1, 2]), scene([floor, lamp], [0, 1])
    without_lamp = scene([floor, mirror], [0, 2], environment=np.ones((4, 8, 3), np.float32))
    assert has_caustics(with_all.in_kernels(), 2)
    assert not has_caustics(with_all.in_kernels(), 1)
    assert not has_caustics(without_mirror.in_kernels(), 5)
    assert not has_caustics(without_lamp.in_kernels(), 5)


def test_most_rays_meet_no_mirror_on_every_backend():
    """A GPU gives back what a kernel has written, and nothing that was in the array before."""
    made = scene([flat((0, 0, 0), 4), flat((0, 3, 0), HALF, -1.0)], [0, 1], [(0, 0.9, 0, 0.5)])
    camera = make_camera(SIZE, SIZE, **VIEW)
    x, y = (one.ravel() for one in np.mgrid[:SIZE, :SIZE])
    rays = camera.rays(x, y)
    ends = follow(made.in_kernels(), *rays, camera, 5, np.random.default_rng(1))
    glass = made.intersect(*rays).material_id == 3
    assert 0 < glass.sum() < SIZE * SIZE / 2
    np.testing.assert_array_equal(ends.ray, np.flatnonzero(glass))
    assert set(ends.material) == {3}
    assert ends.T.max() <= 1 + 1e-5
    made.destroy()
