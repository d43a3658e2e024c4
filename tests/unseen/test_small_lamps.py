"""Lamps that are smaller than a pixel and seen directly: what they may add, and that claims know of it."""

import math

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.camera import make_camera
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.unseen.rare_light import KNOWN, missed, of_kinds, rows_of
from taichi_tracer.unseen.small_lamps import small_lamps

SIZE = 24
VIEW = {"eye": (0, 0, 4), "at": (0, 0, 0), "up": (0, 1, 0), "fov": 40.0}
KE = (3e4, 2e4, 1e4)
RMS = math.sqrt(sum(k * k for k in KE) / 3)
PIXEL = 2 * math.tan(math.radians(20)) / SIZE  # its width at the distance 1


def square(centre, half, facing=1.0):
    """The four corners of a square that looks along ±z."""
    x, y, z = centre
    s = half * facing
    return np.array([[x - s, y - half, z], [x + s, y - half, z], [x + s, y + half, z], [x - s, y + half, z]])


def scene(*lamps, before=None, spheres=(), view=VIEW, **options):
    """A wall under a large lamp behind the eye, and small lamps (centre, half, facing) before it."""
    materials = [Material("wall", Kd=(0.6,) * 3), Material("small", Kd=(0,) * 3, Ke=KE)]
    materials.append(Material("large", Kd=(0,) * 3, Ke=(5.0,) * 3))
    parts, ids = [square((0, 0, 0), 5), square((0, 0, 6), 2, -1.0)], [0, 2]
    for one in lamps:
        parts.append(square(*one))
        ids.append(1)
    if before is not None:
        parts.append(square(*before))
        ids.append(0)
    faces = [[4 * k + i for i in corner] for k in range(len(parts)) for corner in ((0, 1, 2), (0, 2, 3))]
    mesh = Mesh(
        vertices=np.concatenate(parts),
        faces=np.array(faces, np.int32),
        face_materials=np.repeat(ids, 2).astype(np.int32),
        materials=materials,
        spheres=np.array(spheres, float).reshape(-1, 4),
        sphere_materials=np.ones(len(spheres), np.int32),
    )
    return tt.SceneData(mesh, view=view, **options)


def found(made, crop=(0, SIZE, 0, SIZE), **view):
    """The small lamps of a view."""
    return small_lamps(made, make_camera(SIZE, SIZE, **{**VIEW, **view}), crop)


def u(rows, samples, pixels=SIZE * SIZE):
    """What a picture of so many samples misses of this light alone."""
    return missed(of_kinds([rows]), samples, np.ones(pixels))


AT = (0.1, 0.07, 2.0)  # in the middle of no pixel's edge
HALF = 0.004


def test_the_image_of_a_lamp_is_its_share_of_a_pixel():
    """Two triangles of four points, each half of (2 h / (distance · pixel))²."""
    lamps = found(scene((AT, HALF)))
    pixel, chance, light = lamps.T
    share = (2 * HALF / (2 * PIXEL)) ** 2
    x, y = (math.floor(at / (2 * PIXEL) + SIZE / 2) for at in (-AT[0], AT[1]))  # −z has x on the left
    np.testing.assert_allclose(chance, share / 8, rtol=1e-5)
    assert set(pixel) == {x + SIZE * y}
    assert light.sum() == pytest.approx(share * RMS, rel=1e-5)
    assert u(lamps, 1) == pytest.approx(share * RMS / SIZE, rel=1e-5)
    assert u(lamps, 1.01 * KNOWN / share) == 0


def test_an_orthographic_camera_and_a_sphere():
    window = {"projection": "orthographic", "fov": None, "screen_window": (-1, 1, -1, 1)}
    share = (2 * HALF * SIZE / 2) ** 2
    assert found(scene((AT, HALF)), **window)[:, 2].sum() == pytest.approx(share * RMS, rel=1e-5)
    sphere = found(scene(spheres=[(*AT, HALF)]))
    assert sphere[:, 2].sum() == pytest.approx(math.pi * (HALF / (2 * PIXEL)) ** 2 * RMS, rel=0.01)


@pytest.mark.parametrize(
    ("lamp", "before"),
    [
        ((AT, HALF, -1.0), None),  # its back
        (((0.1, 0.07, 5.0), HALF), None),  # behind the eye
        (((3.0, 0.07, 2.0), HALF), None),  # beside the picture
        ((AT, HALF), ((0.08, 0.06, 2.5), 0.1)),  # behind a plate
        ((AT, 0.3), None),  # as large as many pixels
    ],
)
def test_what_is_not_seen_or_large_adds_nothing(lamp, before):
    lamps = found(scene(lamp, before=before))
    assert len(lamps) == 0
    assert u(lamps, 1) == 0


def test_samples_know_of_many_small_lamps():
    """100 lamps that a sample meets with 1 % each: 16 samples meet one of them 16 times."""
    many = rows_of(np.arange(400) // 4, np.full(400, 0.01 / 4), np.full(400, 2.5))
    assert u(many, 16) == 0
    assert u(many, 8) == pytest.approx(math.sqrt(100 * 10.0**2 / 576))
    rare = rows_of(np.array([3, 3]), np.array([0.01, 1e-4]), np.array([3.0, 4.0]))
    assert u(rare, 1, 4) == pytest.approx(7 / 2)
