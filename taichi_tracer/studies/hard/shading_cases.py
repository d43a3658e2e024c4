"""Hard cases of what a surface shows: BRDFs, normals, the film's sums, and energy."""

import copy
import math
import warnings

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.camera import Camera
from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.options import brdfs_of
from taichi_tracer.picture.film import Film
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard.case import EVERYWHERE, LAST_XI, renderer_case
from taichi_tracer.studies.hard.meshes import join, sphere
from taichi_tracer.system import runtime
from taichi_tracer.system.fields import memory
from taichi_tracer.system.parts.registry import PARTS

LENGTH_ERROR = 16  # ε: what the length of a direction, or the weight of a white surface, may be off by
MOST_ENERGY = 1.01  # of what a white surface receives: as much may be reflected, and the rounding of many sums is less
OF_BRDFS = "Ns 0 to 1e21, grazing, below the horizon, ξ = 0 and 1 − 2⁻²⁴"
HEIGHTS = (1.0, 0.5, 1e-3, 1e-6, 0.0, -1e-6, -0.5, -1.0)  # cosines of views
XIS = (0.0, 2.0**-24, 0.25, 0.5, LAST_XI)


@ti.data_oriented
class _Brdfs:
    """What the BRDF of a material says of a pair of directions, and of a sample."""

    def __init__(self, materials: list[Material], brdfs: list[Brdf]) -> None:
        self._memory = memory.Memory()
        self.library = MaterialLibrary(materials, brdfs, self._memory.fields)
        self.brdfs = self.library.brdfs
        self._memory.allocate()
        self.library.tables().load(self._memory)

    @ti.func
    def ask(self, number, w_o, xi):
        """For a material: w_i, weight, eval and pdf there, eval and pdf towards n, and opposite to n. n is +z."""
        n, material = tm.vec3(0, 0, 1), self.library.get(number)
        w_i, numbers = tm.vec3(0), ti.Vector([0.0] * 7)
        for k in ti.static(range(len(self.brdfs))):
            if self.library.brdf_ids[number, 0] == k:
                w_i = self.brdfs[k].sample(material, w_o, n, xi)
                numbers[0] = self.brdfs[k].sample_weight(material, w_o, w_i, n).x
                for j in range(3):
                    to = ti.select(j == 0, w_i, ti.select(j == 1, n, -n))
                    numbers[1 + 2 * j] = self.brdfs[k].eval(material, w_o, to, n).x
                    numbers[2 + 2 * j] = self.brdfs[k].pdf(material, w_o, to, n)
        return w_i, numbers


def answers_of(materials: list[Material], brdfs: list[Brdf] | None, heights, xis) -> np.ndarray:
    """(materials, heights, ξ, ξ, 10) what ``_Brdfs.ask`` finds for every combination of them.

    Args:
        brdfs: None is those that come with the package; each is asked for the materials that it describes.
        heights: cosines of w_o. xis: random numbers, for both dimensions.
    """
    own = [brdf for brdf in brdfs_of(()) if PARTS.comes_with_package(brdf)] if brdfs is None else brdfs
    number, cosine, a, b = np.meshgrid(np.arange(len(materials)), heights, xis, xis, indexing="ij")
    sine = np.sqrt(1 - cosine**2)
    w_o, xi = np.stack([sine * 0.6, sine * 0.8, cosine], axis=-1), np.stack([a, b], axis=-1)
    w_i, numbers = Rows(_Brdfs(materials, own).ask, (WHOLE, 3, 2), (3, 7))(number, w_o, xi)
    return np.hstack([w_i, numbers]).reshape(*number.shape, 10)


def check_answers(found, epsilon, materials, brdfs=None, most_weight: float = 1.0) -> None:
    """Whether answers are numbers, w_i has unit length, weights are in [0, most], and densities are at least 0.

    Args:
        materials, brdfs: as for ``answers_of``.
        most_weight: of a white surface: 1 where directions are drawn in proportion to the BRDF.
    """
    values = answers_of(materials, brdfs, HEIGHTS, XIS).reshape(-1, 10)
    length = np.abs(np.linalg.norm(values[:, :3], axis=1) - 1) > LENGTH_ERROR * epsilon
    weight = (values[:, 3] < 0) | (values[:, 3] > most_weight * (1 + LENGTH_ERROR * epsilon))
    negative = (values[:, 4:] < 0).any(axis=1)
    nan = ~np.isfinite(values).all(axis=1)
    found.add((length | weight | negative) & ~nan, int(nan.sum()))


def check_energy(found, materials, heights, brdfs=None) -> None:
    """Whether white surfaces reflect at most ``MOST_ENERGY`` of what they receive, four deviations granted."""
    grid = (np.arange(64) + 0.5) / 64  # ξ, in both dimensions
    weights = answers_of(materials, brdfs, heights, grid)[..., 3]
    mean, deviation = weights.mean(axis=(2, 3)), weights.std(axis=(2, 3)) / len(grid)
    found.add(mean > MOST_ENERGY + 4 * deviation, int((~np.isfinite(weights)).sum()))


def white_surfaces() -> list[Material]:
    """White materials, one for each exponent."""
    exponents = (0.0, 0.5, 1.0, 1.0 + 2.0**-20, 2.0, 50.0, 1e3, 1e6, 1e9, 1e13, 1e14, 1e16, 1e21)
    return [Material(Kd=(1.0, 1.0, 1.0), Ns=exponent) for exponent in exponents]


@renderer_case(f"BRDFs: {OF_BRDFS}", EVERYWHERE)
def brdfs_of_the_package(found, epsilon):
    """Exponents from 0 to 1e21, views along the surface and from below, ξ = 0 and the last before 1.

    cos^α of a negative cosine is NaN; with α = 1e21 the lobe over its density is 0/0 or ∞/∞; ln 0 is infinite; a vector
    with |z| a rounding above 1 has the square root of a negative number for its sine.
    """
    check_answers(found, epsilon, white_surfaces())


def own_brdf(brdf: Brdf, found, epsilon) -> None:
    """A BRDF that somebody registered, with the materials that it describes, or with all where it describes none.

    0/0 where the lobe and its density underflow together, the root of a negative number along the surface, a frame
    about a fixed axis: pictures show these as dots that come and go. A white surface that reflects more than it
    receives makes energy out of nothing. Single weights may be large: directions need not be drawn in proportion to
    the BRDF.
    """
    every, alone = white_surfaces(), copy.copy(brdf)
    materials = [m for m in every if brdf.describes(m, runtime.dtype())] or every
    alone.describes = lambda material, dtype: True
    check_answers(found, epsilon, materials, [alone], math.inf)
    check_energy(found, materials, (1.0, 0.5, 0.05), [alone])


@renderer_case("opposite vertex normals")
def opposite_normals(found, epsilon):
    """A triangle whose vertex normals cancel on the way from one corner to another.

    0/|0| is NaN, in the middle of an edge only: a black or white dot that moves with the camera. Along the edge
    between the two, every normal must have unit length.
    """
    mesh = Mesh(
        vertices=np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]),
        faces=np.array([[0, 1, 2]]),
        normals=np.array([[1.0, 0, 0], [-1, 0, 0], [0, 0, 0]]),
        face_normals=np.array([[0, 1, 2]], np.int32),
    )
    scene = SceneData(mesh, intersector="brute_force")
    x = np.arange(1, 64) / 64
    hits = scene.intersect(np.stack([x, 0 * x, 0 * x + 1], axis=1), [0, 0, -1.0])
    length = np.linalg.norm(hits.normal.astype(np.float64), axis=1)
    found.add(~hits.is_hit | (np.abs(length - 1) > 8 * epsilon), int(np.isnan(length).sum()))


@ti.kernel
def expose(film: ti.template(), value: float, samples: ti.i32):
    """Add so many samples of the same value to every pixel of a film of one row."""
    for x in range(film.width):
        for k in range(samples):
            film.add(x, 0, tm.vec3(value, value / 3, value * 1000), k)


@renderer_case("accumulation of 1e7 samples")
def accumulation(found, epsilon):
    """The mean of 1e7 samples of the same value.

    A plain f32 sum is off by 1 % at 1e6 samples, and a sum of ones stands still at 2²⁴. What is lost in each addition
    has to be kept. The mean must be the value, within two roundings.
    """
    film, samples = Film(1, 1), 10_000_000
    value = float(runtime.dtype()(0.1))
    expose(film, value, samples)
    film.show()
    mean = film.canvas.to_numpy().astype(np.float64)[0, 0]
    off = np.abs(mean / (np.array([1, 1 / 3, 1000]) * value) - 1)
    found.add(~(off <= 2 * epsilon), tried=samples)
    found.add(film.counts().max() != samples, tried=0)


def furnace(estimator: str, found, epsilon) -> None:
    """White spheres, matte, glossy and mirror, in an even white light: nothing may be brighter than the light.

    A density in the wrong measure, a lobe that is not normalised, a weight that does not cancel: each makes energy out
    of nothing, which a picture with shadows hides. Every path is followed to its end, without Russian roulette. The
    mean radiance of each sphere must be at most 1.01, four deviations granted, and all samples finite.
    """
    exponents = (1.0, 20.0, 1e21)
    vertices, faces = join([sphere(10, 6, 1.0, (2.5 * k, 0, 0)) for k in range(len(exponents))])
    mesh = Mesh(
        vertices=vertices,
        faces=faces,
        face_materials=np.repeat(np.arange(3), len(faces) // 3).astype(np.int32),
        materials=[Material(name=f"Ns{e:g}", Kd=(1.0, 1.0, 1.0), Ns=e) for e in exponents],
    )
    scene = SceneData(mesh, intersector="brute_force", environment=np.ones((1, 1, 3)))
    view = {"eye": (2.5, 0, 60.0), "at": (2.5, 0, 0), "up": (0, 1, 0), "fov": 2.4}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        renderer = A2Renderer(scene, camera=Camera(96, 32, **view)).use(estimator).render(64)
    image, variance = renderer.image().astype(np.float64), renderer.film.variance_of_mean()
    for third in range(3):
        columns = slice(32 * third, 32 * (third + 1))
        deviation = math.sqrt(variance[:, columns].sum()) / variance[:, columns].size
        is_dark_enough = image[:, columns].mean() <= MOST_ENERGY + 4 * deviation
        found.add(not is_dark_enough, tried=image[:, columns, 0].size * 64)
    found.add(False, int(renderer.non_finite + np.isnan(image).any(axis=2).sum()), tried=0)
