"""Hard cases of what a surface shows: BRDFs, normals, the film's sums, and energy."""

import copy
import math
import warnings

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.camera import Camera
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.options import brdfs_of
from taichi_tracer.picture.film import Film
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard.case import LAST_XI, RendererCase
from taichi_tracer.studies.hard.meshes import sphere
from taichi_tracer.system import runtime
from taichi_tracer.system.fields import memory
from taichi_tracer.system.parts.registry import PARTS

LENGTH_ERROR = 16  # ε: what the length of a direction, or the weight of a white surface, may be off by
MOST_ENERGY = 1.01  # of what a white surface receives: as much may be reflected, and the rounding of many sums is less


@ti.data_oriented
class _Brdfs:
    """What the BRDF of a material says of a pair of directions, and of a sample."""

    def __init__(self, materials: list[Material], brdfs: list[Brdf]) -> None:
        self._memory = memory.Memory()
        self.library = MaterialLibrary(materials, brdfs, self._memory.fields)
        self.brdfs = self.library.brdfs
        self._memory.allocate()
        self.library.tables().load(self._memory)

    @ti.kernel
    def ask(
        self,
        ids: ti.types.ndarray(ndim=1),
        w_o: ti.types.ndarray(ndim=2),
        xi: ti.types.ndarray(ndim=2),
        found: ti.types.ndarray(ndim=2),
    ):
        """Columns: w_i, weight, eval and pdf there, eval and pdf towards n, and opposite to n. n is +z."""
        for i in range(ids.shape[0]):
            n = tm.vec3(0, 0, 1)
            o = tm.vec3(w_o[i, 0], w_o[i, 1], w_o[i, 2])
            material = self.library.get(ids[i])
            for k in ti.static(range(len(self.brdfs))):
                if self.library.brdf_ids[ids[i], 0] == k:
                    w_i = self.brdfs[k].sample(material, o, n, tm.vec2(xi[i, 0], xi[i, 1]))
                    found[i, 0], found[i, 1], found[i, 2] = w_i.x, w_i.y, w_i.z
                    found[i, 3] = self.brdfs[k].sample_weight(material, o, w_i, n).x
                    for j in range(3):
                        to = ti.select(j == 0, w_i, ti.select(j == 1, n, -n))
                        found[i, 4 + 2 * j] = self.brdfs[k].eval(material, o, to, n).x
                        found[i, 5 + 2 * j] = self.brdfs[k].pdf(material, o, to, n)


class Brdfs(RendererCase):
    """Exponents from 0 to 1e21, views along the surface and from below, ξ = 0 and the last before 1.

    cos^α of a negative cosine is NaN; with α = 1e21 the lobe over its density is 0/0 or ∞/∞; ln 0 is infinite; a vector
    with |z| a rounding above 1 has the square root of a negative number for its sine.
    """

    what = "Ns 0 to 1e21, grazing, below the horizon, ξ = 0 and 1 − 2⁻²⁴"
    name = f"BRDFs: {what}"
    exponents = (0.0, 0.5, 1.0, 1.0 + 2.0**-20, 2.0, 50.0, 1e3, 1e6, 1e9, 1e13, 1e14, 1e16, 1e21)
    heights = (1.0, 0.5, 1e-3, 1e-6, 0.0, -1e-6, -0.5, -1.0)
    xis = (0.0, 2.0**-24, 0.25, 0.5, LAST_XI)
    most_weight = 1.0  # of a white surface, where directions are drawn in proportion to the BRDF
    views_from_above = (1.0, 0.5, 0.05)  # for ``check_energy``
    grid = (np.arange(64) + 0.5) / 64  # ξ, in both dimensions

    def materials(self) -> list[Material]:
        """White materials, one for each exponent."""
        return [Material(Kd=(1.0, 1.0, 1.0), Ns=exponent) for exponent in self.exponents]

    def brdfs(self) -> list[Brdf]:
        """The BRDFs that come with the package; each is asked for the materials that it describes."""
        return [brdf for brdf in brdfs_of(()) if PARTS.comes_with_package(brdf)]

    def answers(self, heights, xis) -> np.ndarray:
        """(materials, heights, ξ, ξ, 10) what ``_Brdfs.ask`` finds for every combination of them."""
        dtype, materials = runtime.dtype(), self.materials()
        ids, cosine, a, b = np.meshgrid(np.arange(len(materials), dtype=np.int32), heights, xis, xis, indexing="ij")
        sine = np.sqrt(1 - cosine**2)
        w_o = np.stack([sine * 0.6, sine * 0.8, cosine], axis=-1).reshape(-1, 3)
        xi, found = np.stack([a, b], axis=-1).reshape(-1, 2), np.empty((ids.size, 10), dtype)
        _Brdfs(materials, self.brdfs()).ask(ids.ravel(), w_o.astype(dtype), xi.astype(dtype), found)
        return found.astype(np.float64).reshape(*ids.shape, 10)

    def check(self, found, epsilon):
        """All answers are numbers, w_i has unit length, weights are in [0, 1], and densities are at least 0."""
        values = self.answers(self.heights, self.xis).reshape(-1, 10)
        length = np.abs(np.linalg.norm(values[:, :3], axis=1) - 1) > LENGTH_ERROR * epsilon
        weight = (values[:, 3] < 0) | (values[:, 3] > self.most_weight * (1 + LENGTH_ERROR * epsilon))
        negative = (values[:, 4:] < 0).any(axis=1)
        nan = ~np.isfinite(values).all(axis=1)
        found.add((length | weight | negative) & ~nan, int(nan.sum()))

    def check_energy(self, found) -> None:
        """Whether the mean weight is at most ``MOST_ENERGY``, four deviations granted."""
        weights = self.answers(self.views_from_above, self.grid)[..., 3]
        mean = weights.mean(axis=(2, 3))
        deviation = weights.std(axis=(2, 3)) / len(self.grid)
        found.add(mean > MOST_ENERGY + 4 * deviation, int((~np.isfinite(weights)).sum()))


class OwnBrdf(Brdfs):
    """A BRDF that somebody registered, with the materials that it describes, or with all where it describes none.

    0/0 where the lobe and its density underflow together, the root of a negative number along the surface, a frame
    about a fixed axis: pictures show these as dots that come and go. A white surface that reflects more than it
    receives makes energy out of nothing.
    """

    most_weight = math.inf  # of one sample: directions need not be drawn in proportion to the BRDF

    def __init__(self, brdf: Brdf) -> None:
        self.brdf, self.name = brdf, f"BRDF {brdf.name}: {self.what}"

    def materials(self) -> list[Material]:
        """The materials that the BRDF describes."""
        every = super().materials()
        return [m for m in every if self.brdf.describes(m, runtime.dtype())] or every

    def brdfs(self) -> list[Brdf]:
        """The BRDF that is tried, which here describes every material."""
        alone = copy.copy(self.brdf)
        alone.describes = lambda material, dtype: True
        return [alone]

    def check(self, found, epsilon):
        """As for the package's own; and a white surface reflects no more than it receives."""
        super().check(found, epsilon)
        self.check_energy(found)


class OppositeNormals(RendererCase):
    """A triangle whose vertex normals cancel on the way from one corner to another.

    0/|0| is NaN, in the middle of an edge only: a black or white dot that moves with the camera.
    """

    name = "opposite vertex normals"

    def check(self, found, epsilon):
        """Along the edge between the two, every normal has unit length."""
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


@ti.data_oriented
class _Exposure:
    """A film, and a constant added to it very often."""

    def __init__(self, film: Film) -> None:
        self.film = film

    @ti.kernel
    def expose(self, value: float, samples: ti.i32):
        """Add so many samples of the same value to every pixel."""
        for x in range(self.film.width):
            for k in range(samples):
                self.film.add(x, 0, tm.vec3(value, value / 3, value * 1000), k)


class Accumulation(RendererCase):
    """The mean of 1e7 samples of the same value.

    A plain f32 sum is off by 1 % at 1e6 samples, and a sum of ones stands still at 2²⁴. What is lost in
    each addition has to be kept.
    """

    name = "accumulation of 1e7 samples"
    samples = 10_000_000

    def check(self, found, epsilon):
        """The mean is the value, within two roundings."""
        film = Film(1, 1)
        value = float(runtime.dtype()(0.1))
        _Exposure(film).expose(value, self.samples)
        film.show()
        mean = film.canvas.to_numpy().astype(np.float64)[0, 0]
        truth = np.array([1, 1 / 3, 1000]) * value
        off = np.abs(mean / truth - 1)
        found.add(~(off <= 2 * epsilon), tried=self.samples)
        found.add(film.counts().max() != self.samples, tried=0)


class Furnace(RendererCase):
    """White spheres, matte, glossy and mirror, in an even white light: nothing may be brighter than the light.

    A density in the wrong measure, a lobe that is not normalised, a weight that does not cancel: each makes energy out
    of nothing, which a picture with shadows hides. Every path is followed to its end, without Russian roulette.
    """

    exponents = (1.0, 20.0, 1e21)

    def __init__(self, estimator) -> None:
        self.estimator, self.name = estimator, f"furnace: {estimator.name}"

    def check(self, found, epsilon):
        """The mean radiance of each sphere is at most 1.01, four deviations granted, and all samples are finite."""
        parts = [sphere(10, 6, 1.0, (2.5 * k, 0, 0)) for k in range(len(self.exponents))]
        offsets = np.cumsum([0] + [len(v) for v, _ in parts])[:-1]
        mesh = Mesh(
            vertices=np.concatenate([v for v, _ in parts]),
            faces=np.concatenate([f + k for (_, f), k in zip(parts, offsets, strict=True)]),
            face_materials=np.repeat(np.arange(3), len(parts[0][1])).astype(np.int32),
            materials=[Material(name=f"Ns{e:g}", Kd=(1.0, 1.0, 1.0), Ns=e) for e in self.exponents],
        )
        scene = SceneData(mesh, intersector="brute_force", environment=np.ones((1, 1, 3)))
        view = {"eye": (2.5, 0, 60.0), "at": (2.5, 0, 0), "up": (0, 1, 0), "fov": 2.4}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            renderer = A2Renderer(scene, camera=Camera(96, 32, **view)).use(self.estimator.name)
            renderer.render(64)
        image, variance = renderer.image().astype(np.float64), renderer.film.variance_of_mean()
        for third in range(3):
            columns = slice(32 * third, 32 * (third + 1))
            mean = image[:, columns].mean()
            deviation = math.sqrt(variance[:, columns].sum()) / variance[:, columns].size
            found.add(not mean <= MOST_ENERGY + 4 * deviation, tried=image[:, columns, 0].size * 64)
        found.add(False, int(renderer.non_finite + np.isnan(image).any(axis=2).sum()), tried=0)
