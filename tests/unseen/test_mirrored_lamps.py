"""Lamps that mirrors and glass show as less than a pixel."""

import numpy as np
import pytest
from unseen_scenes import MATERIALS, SIZE, flat, scene, upright

from taichi_tracer.camera import make_camera
from taichi_tracer.unseen.mirror_chains import OF_FEW_RAYS, has_mirrors
from taichi_tracer.unseen.mirrored_lamps import mirrored_lamps
from taichi_tracer.unseen.small_lamps import pixels_of
from taichi_tracer.unseen.small_suns import suns_of

VIEW = {"eye": (-2.0, 1.0, 0.5), "at": (1.5, 1.0, 0), "up": (0, 1, 0), "fov": 50.0}
KE, HALF = 2e4, 0.004


def images(made, max_bounces=1):
    """The images of lamps in the view."""
    camera = make_camera(SIZE, SIZE, **VIEW)
    return mirrored_lamps(
        made.in_kernels(), made, camera, (0, SIZE, 0, SIZE), max_bounces, suns_of(made.in_kernels())
    ), camera


def test_a_flat_mirror_shows_a_lamp_as_large_as_the_lamp_behind_it():
    """The mirror stands at x = 1.5, so that the image of the lamp is at x = 3; it keeps the cosine of the angle."""
    middle = np.array([0.0, 1.3, 0.2])
    lamp = upright(0, HALF) + middle - [0, HALF, 0]
    made = scene([flat((0, 0, 0), 6), lamp, upright(1.5, 3, -1.0)], [0, 1, 2])
    found, camera = images(made)
    pixel, chance, light = found.T
    image = lamp * [-1, 1, 1] + [3, 0, 0]
    at = pixels_of(camera, image)
    a, b = at[1] - at[0], at[3] - at[0]
    area = abs(a[0] * b[1] - a[1] * b[0])
    to = np.array([3, 1.3, 0.2]) - VIEW["eye"]
    kept = to[0] / np.linalg.norm(to)
    assert chance.sum() == pytest.approx(area, rel=0.1)
    assert light.sum() == pytest.approx(OF_FEW_RAYS * area * KE * kept, rel=0.1)
    place = np.floor(at.mean(axis=0) + 0.5)
    assert np.hypot(pixel % SIZE - place[0], pixel // SIZE - place[1]).max() < 0.3 * SIZE
    made.destroy()


@pytest.mark.parametrize(
    ("lamp", "beside"),
    [
        (upright(0, HALF, -1.0) + [0, 1.3, 0.2], None),  # its back
        (upright(0, HALF) + [0, 1.3, 0.2], upright(0.5, 0.5) + [0, 0.9, 0.2]),  # a plate before it
        (upright(1.6, HALF) + [0, 1.3, 0.2], None),  # behind the mirror
    ],
)
def test_what_a_mirror_does_not_show_adds_nothing(lamp, beside):
    parts, ids = [flat((0, 0, 0), 6), lamp, upright(1.5, 3, -1.0)], [0, 1, 2]
    if beside is not None:
        parts, ids = [*parts, beside], [*ids, 0]
    made = scene(parts, ids)
    found, _ = images(made)
    assert found[:, 2].sum() == 0
    made.destroy()


def test_without_a_mirror_in_view_or_in_the_scene():
    behind = scene([flat((0, 0, 0), 6), flat((0, 3, 0), HALF, -1.0), upright(-4, 0.5, 1.0)], [0, 1, 2])
    assert len(images(behind)[0]) == 0
    without = scene([flat((0, 0, 0), 6), flat((0, 3, 0), HALF, -1.0)], [0, 1])
    assert has_mirrors(behind.in_kernels())
    assert not has_mirrors(without.in_kernels())
    assert MATERIALS[2].Ns > 1e14
