"""The same pictures as Mitsuba 3, which shares no line with this package; skipped where it is not installed.

Each picture is rendered several times with independent numbers on both sides. Blocks of pixels are compared by Welch's
test, with a significance for all blocks and channels together. BRDFs are compared as numbers.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from support import start

import taichi_tracer as tt
from taichi_tracer.files import read
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import find_scene, own_view

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
mitsuba_scenes = pytest.importorskip("benchmarks.mitsuba_scenes")

VARIANT = "scalar_rgb"
BLOCK, RENDERS, ROWS = 8, 8, 128
SAME = 2e-4  # of the radiance: what may differ by the texels
SIGNIFICANCE = 1e-3  # of the smallest p among all blocks and channels of a picture (Šidák)


def blocks(pictures):
    """(RENDERS, …) means of blocks of pixels, of a list of pictures."""
    h, w, _ = pictures[0].shape
    whole = np.stack(pictures).astype(np.float64)
    return whole.reshape(len(pictures), h // BLOCK, BLOCK, w // BLOCK, BLOCK, 3).mean(axis=(2, 4))


def rendered(renderer, spp):
    """Pictures of this package with several seeds, from a camera that mirrors nothing, like Mitsuba's."""
    renderer.camera.set_camera_parameters(handedness="right")
    found = []
    for seed in range(RENDERS):
        renderer.seed = seed
        renderer.begin_anew()
        found.append(renderer.render(spp).image())
    return found


def check_same(ours, theirs, significance=SIGNIFICANCE):
    """Welch's test of the means of each block and channel."""
    a, b = blocks(ours), blocks(theirs)
    spread = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / RENDERS) + SAME * b.mean(axis=0)
    t = np.abs(a.mean(axis=0) - b.mean(axis=0)) / np.maximum(spread, 1e-12)
    p = 2 * stats.t.sf(t, 2 * (RENDERS - 1))
    assert p.min() > 1 - (1 - significance) ** (1 / p.size), f"largest t {t.max():.1f} in block {np.argmax(t)}"


def matte(name):
    """A shipped mesh of which every material is diffuse: Mitsuba has no Phong BRDF."""
    mesh = read(find_scene(name))
    return replace(mesh, materials=[replace(material, Ns=1.0) for material in mesh.materials])


SIZES = {"cornell_box": (48, 48), "veach_plates": (64, 32)}
PATHS = [pytest.param("cornell_box", 5, marks=pytest.mark.slow)]


@pytest.mark.parametrize(("scene", "bounces"), PATHS)
def test_paths_of_as_many_bounces(scene, bounces):
    """Lamps alone: 2 of them, and 2,000; the three integrators of paths have the same mean, see test_paths.py."""
    start("f32")
    mesh, view, (width, height) = matte(scene), own_view(find_scene(scene)), SIZES[scene]
    renderer = tt.A4Renderer(SceneData(mesh, view=view), width, height, sampler="independent").use("path")
    renderer.max_bounces = bounces
    settings = mitsuba_scenes.path(bounces), width, height, VARIANT
    picture = mitsuba_scenes.MitsubaPicture(mesh, *settings, view=view)
    check_same(rendered(renderer, 32), [picture.render(32, seed) for seed in range(RENDERS)])
