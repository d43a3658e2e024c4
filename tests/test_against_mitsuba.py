"""The same pictures as Mitsuba 3, which shares no line with this package; skipped where it is not installed.

Each picture is rendered several times with independent numbers on both sides. Blocks of pixels are compared by Welch's
test, with a significance for all blocks and channels together. BRDFs are compared as numbers.
"""

from dataclasses import replace

import numpy as np
import pytest
from oracles.microfacets import masking
from scipy import stats
from support import start

import taichi_tracer as tt
from taichi_tracer.brdfs.microfacet import Microfacet
from taichi_tracer.contracts.brdfs import Bench
from taichi_tracer.files import read
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import find_scene, own_view
from taichi_tracer.system import memory

mitsuba_scenes = pytest.importorskip("benchmarks.mitsuba_scenes", reason="Mitsuba is not installed")
mitsuba = pytest.importorskip("mitsuba")

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


# ── the rough conductor, of which Mitsuba computes in f32 ──

N = np.array([0.0, 0.0, 1.0])
METALS, PAIRS = 50, 20


class WhiteMetals(Bench):
    """Microfacets that reflect everything, one for each (α_x, α_y)."""

    def __init__(self, alphas):
        self.brdf, self.alphas = Microfacet(), alphas
        self.materials = [Material(alpha_x=x, alpha_y=y, F0=1.0) for x, y in alphas.tolist()]
        self._memory = memory.Memory()
        self.library = MaterialLibrary(self.materials, [self.brdf], self._memory.fields)
        self._memory.allocate()
        self.library.tables().load(self._memory)


def their_metal(alpha):
    """Mitsuba's BSDF with the same roughness; without a material, it reflects everything."""
    kind = {"type": "roughconductor", "distribution": "ggx", "material": "none", "sample_visible": True}
    return mitsuba.load_dict(kind | {"alpha_u": float(alpha[0]), "alpha_v": float(alpha[1])})


def their_view(w_o):
    """Mitsuba calls the direction to the viewer ``wi``, and that to the light ``wo``."""
    at = mitsuba.SurfaceInteraction3f()
    at.wi = mitsuba.Vector3f(*w_o)
    return at


def above(rng, count):
    """(count, 3) directions above the surface, down to 0.6 degrees, as f32 has them."""
    z, phi = rng.uniform(0.01, 1, count), rng.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - z * z)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=1).astype(np.float32).astype(np.float64)


def of_separate_sides(alpha, w_o, w_i):
    """(n,) what Mitsuba's G is, of this one: light and viewer hide normals independently there, G1(ω_o) G1(ω_i)."""
    a, b = masking(alpha, w_o), masking(alpha, w_i)
    return (1 + a + b) / ((1 + a) * (1 + b))


def random_metals(rng, count):
    """(count, 2) roughnesses, as f32 has them."""
    return np.exp(rng.uniform(np.log(0.02), 0, (count, 2))).astype(np.float32).astype(np.float64)


def test_samples_of_a_rough_metal_have_mitsubas_mean(rng):
    """The mean direction, and the mean weight after the exchange of G; 4,096 samples each, of several views."""
    start("f64")
    mitsuba.set_variant(VARIANT)
    count, views, context = 4096, 8, mitsuba.BSDFContext()
    alphas, significance = random_metals(rng, views), 1e-4
    ours, scores = WhiteMetals(alphas), []
    for k, (alpha, w_o) in enumerate(zip(alphas, above(rng, views), strict=True)):
        theirs, at = their_metal(alpha), their_view(w_o)
        drawn = [theirs.sample(context, at, 0.5, mitsuba.Point2f(*xi)) for xi in rng.random((count, 2)).tolist()]
        found = np.array([[*sample.wo, value[0]] for sample, value in drawn], np.float64)
        own = ours.sample(k, w_o, N, rng.random((count, 2)))
        of_G = np.where(own[:, 2] > 0, of_separate_sides(alpha, np.tile(w_o, (count, 1)), own), 0)
        own = np.column_stack([own, ours.values(k, w_o, N, own)[2][:, 0] * of_G])
        is_lost = found[:, 3] == 0  # what leaves below the surface has no direction there
        own[own[:, 2] <= 0], found[is_lost] = 0, 0
        error = np.sqrt((own.var(axis=0) + found.var(axis=0)) / count)
        scores.append(np.abs(own.mean(axis=0) - found.mean(axis=0)) / np.maximum(error, 1e-6))
    assert np.max(scores) < stats.norm.isf(significance / 2 / np.size(scores))
