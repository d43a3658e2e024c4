"""What a case is: a mesh, rays, and what must hold of the answers; and the stage, a scene that several cases share.

Meshes are (vertices, faces), in float64 numbers that f32 holds exactly: every precision meets the same triangles.
"""

import time
import warnings
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.contracts.lab import WHOLE, Rows
from taichi_tracer.files.arrays import mesh_from_arrays
from taichi_tracer.formulas.triangles import stable_normal
from taichi_tracer.geometry import Mesh, unit
from taichi_tracer.ray import Ray, RayHits, offset_origin
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.modes import RayMode

# ── meshes ──


def as_f32(values) -> np.ndarray:
    """The nearest f32 numbers, as float64."""
    return np.asarray(values, np.float32).astype(np.float64)


def unit_rows(vectors: np.ndarray) -> np.ndarray:
    """(n, 3) vectors of length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def sphere(columns: int, rows: int, radius: float = 1.0, centre=(0.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """A closed sphere of 2·columns·(rows − 1) triangles, fronts outside, poles on the y axis."""
    theta = np.linspace(0, np.pi, rows + 1)[1:-1, None]
    phi = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    ring = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta) + 0 * phi, -np.sin(theta) * np.sin(phi)], axis=-1)
    vertices = np.concatenate([[[0, 1, 0]], ring.reshape(-1, 3), [[0, -1, 0]]])
    k = np.arange(columns)
    after = (k + 1) % columns
    last = len(vertices) - 1
    top = np.stack([0 * k, 1 + k, 1 + after], axis=1)
    bottom = np.stack([last + 0 * k, last - columns + after, last - columns + k], axis=1)
    r = np.arange(rows - 2)[:, None] * columns
    a, b = (1 + r + k).ravel(), (1 + r + after).ravel()
    upper, lower = np.stack([a, a + columns, b], axis=1), np.stack([b, a + columns, b + columns], axis=1)
    return as_f32(vertices * radius + np.asarray(centre)), np.concatenate([top, upper, lower, bottom])


def separate(triangles) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3, 3) corners as a mesh whose triangles share no vertex."""
    vertices = as_f32(triangles).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def join(meshes) -> tuple[np.ndarray, np.ndarray]:
    """Several meshes as one, their triangles one after the other."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [f + offset for (_, f), offset in zip(meshes, offsets, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)


def height_field(rng, cells: int, centre) -> tuple[np.ndarray, np.ndarray]:
    """cells² squares of two triangles over the xz plane; corners are even, so that edges' middles are integers, too."""
    x, z = np.meshgrid(np.arange(cells + 1), np.arange(cells + 1), indexing="ij")
    y = rng.integers(-1, 2, x.shape)
    vertices = 2.0 * np.stack([x - cells // 2, y, z - cells // 2], axis=-1).reshape(-1, 3) + centre
    i, j = (a.ravel() for a in np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij"))
    a = i * (cells + 1) + j
    b, c, d = a + 1, a + cells + 1, a + cells + 2
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])


def box(low, high) -> tuple[np.ndarray, np.ndarray]:
    """The closed surface of an axis-parallel box, fronts outside."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    low, high = np.asarray(low, float), np.asarray(high, float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return low + corner * (high - low), np.array(faces)


def edges_of(faces: np.ndarray) -> np.ndarray:
    """(E, 2) vertex ids of every edge."""
    corners = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(corners, axis=0)


def normals_of(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3) unit normals in float64."""
    v0, v1, v2 = (vertices[faces[:, k]] for k in range(3))
    return unit_rows(np.cross(v1 - v0, v2 - v0))


# ── cases ──


LAST_XI = 1 - 2.0**-24  # the largest random number
ROUNDING = 16  # how many ε of its farthest corner a ray may pass a triangle by and still hit it, see ``false_hits``


@dataclass
class CaseRays:
    """Rays of one case, and what their judge has to know of each: arrays with a row per ray, all f32-representable."""

    origins: np.ndarray
    directions: np.ndarray
    known: dict[str, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.origins)

    def __getitem__(self, rows) -> "CaseRays":
        """Some of the rays: a slice, their numbers, or a bool for each."""
        known = {name: values[rows] for name, values in self.known.items()}
        return CaseRays(self.origins[rows], self.directions[rows], known)


def joined(parts: Sequence[CaseRays]) -> CaseRays:
    """The rays of several parts, one after the other; all of which know the same of their rays."""
    known = {name: np.concatenate([part.known[name] for part in parts]) for name in parts[0].known}
    origins = np.concatenate([part.origins for part in parts])
    return CaseRays(origins, np.concatenate([part.directions for part in parts]), known)


class Case(ABC):
    """One thing that goes wrong in naive code, which the docstring of the subclass says in plain words.

    Attributes:
        name: what the table calls it.
        stage: the scene that it shares with others; cases of one stage do not lie in each other's way.
        rays_wanted: how many rays there should be, over those of others.
    """

    name: str
    stage: str
    rays_wanted = 1.0

    @abstractmethod
    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices and faces."""

    @abstractmethod
    def rays(self, rng, count: int) -> CaseRays:
        """About ``count`` rays."""

    @abstractmethod
    def judge(self, on: "CaseInScene", rays: CaseRays, epsilon: float) -> dict[str, float]:
        """Findings, named as in ``modes.COUNTS``, and the number of rays they are out of where it matters."""

    def build(self) -> tuple[np.ndarray, np.ndarray]:
        """Make the mesh, which ``rays`` needs, and keep it."""
        self.vertices, self.faces = self.mesh()
        return self.vertices, self.faces

    def rng(self, chunk: int = 0):
        """Random numbers that depend on the case alone."""
        return np.random.default_rng([zlib.crc32(self.name.encode()), chunk])

    def gathered(self, count: int) -> CaseRays:
        """The rays of the case, the same in every mode, in a random order so that any first part of them will do."""
        rays = self.rays(self.rng(), count)
        return rays[self.rng(1).permutation(len(rays))]


@dataclass
class CaseTally:
    """What a ``RendererCase`` counts: how many things were tried, and how many answers are wrong, or are NaN."""

    tried: int = 0
    wrong: int = 0
    nan: int = 0

    def add(self, wrong: np.ndarray | bool, nan: int = 0, tried: int | None = None) -> None:
        """Count answers, of which ``wrong`` says whether each is; ``tried`` if they are not all that were tried."""
        self.tried += np.size(wrong) if tried is None else tried
        self.wrong, self.nan = self.wrong + int(np.sum(wrong)), self.nan + nan


# From which level on a case of the rest of the renderer is tried: in every precision, from "quick", "default", "full".
EVERYWHERE, QUICK, USUAL, LARGE = range(4)


@dataclass(frozen=True)
class RendererCase:
    """One thing that goes wrong in naive code outside of the search for hits.

    Attributes:
        name: what the table calls it.
        check: tries things and counts what is wrong, given a ``CaseTally`` and ε. Its docstring begins with what could
            break.
        cost: one of ``EVERYWHERE``, ``QUICK``, ``USUAL``, ``LARGE``.
    """

    name: str
    check: Callable[[CaseTally, float], None]
    cost: int = QUICK

    def judge(self, epsilon: float) -> dict[str, float]:
        """How many things were ``tried``, how many answers are ``wrong`` or ``nan``."""
        found = CaseTally()
        self.check(found, epsilon)
        return vars(found)


RENDERER_CASES: list[RendererCase] = []  # in the order of their definition


def renderer_case(name: str, cost: int = QUICK) -> Callable:
    """Make the function that follows the ``check`` of a ``RendererCase``."""

    def add(check: Callable[[CaseTally, float], None]) -> Callable[[CaseTally, float], None]:
        RENDERER_CASES.append(RendererCase(name, check, cost))
        return check

    return add


@ti.data_oriented
class Probe:
    """Questions about single triangles that a scene is not asked from Python."""

    def __init__(self, scene: SceneData) -> None:
        self.geometry, self.intersector = scene.geometry, scene.ray_intersector
        self.left, self.met = Rows(self.leave, (WHOLE, 2, 3), (3,)), Rows(self.meet, (3, 3, WHOLE), (1,))

    @ti.func
    def leave(self, triangle_id, barycentrics, d):
        """Where a ray starts that leaves a triangle at (u, v), on the side that its direction points to."""
        v0, v1, v2 = self.geometry.triangle(triangle_id)
        p, error = self.geometry.position(triangle_id, barycentrics.x, barycentrics.y)
        n = unit(stable_normal(v0, v1, v2))
        return offset_origin(p, error, ti.select(tm.dot(d, n) < 0, -n, n))

    @ti.func
    def meet(self, origin, direction, triangle_id):
        """t of a ray on a triangle alone, as exact as that of a nearest hit; ∞ where it misses."""
        ray = Ray(origin=origin, direction=direction)
        hit = self.intersector.with_exact_distance(
            ray, self.intersector.intersect_triangle(ray, triangle_id), 0.0, tm.inf
        )
        return ti.select(hit.is_hit, hit.distance, tm.inf)


class CaseInScene:
    """A case in the scene of its stage, in one mode: what the judge can ask."""

    def __init__(self, scene: SceneData, probe: Probe, first: int, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.scene, self.probe, self.first = scene, probe, first
        self.vertices, self.faces = vertices, faces
        self.intersected = []

    def intersect(self, rays: CaseRays, **window) -> RayHits:
        """The scene's answers; they are kept, to be compared with those of other intersectors."""
        hits = self.scene.intersect(rays.origins, rays.directions, **window)
        self.intersected.append(hits)
        return hits

    def own(self, hits: RayHits) -> np.ndarray:
        """The case's own triangle that each ray met, −1 where it met none or another case's."""
        local = hits.triangle_id - self.first
        return np.where((local >= 0) & (local < len(self.faces)), local, -1)

    def corners(self, ids: np.ndarray) -> np.ndarray:
        """(n, 3, 3) corners of own triangles."""
        return self.vertices[self.faces[ids]]

    def meet(self, rays: CaseRays, ids: np.ndarray) -> np.ndarray:
        """t of every ray on one own triangle each, whatever lies before it; ∞ where it misses."""
        return self.probe.met(rays.origins, rays.directions, ids + self.first)

    def leave(self, ids: np.ndarray, barycentrics: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Origins of rays that leave own triangles."""
        return self.probe.left(ids + self.first, barycentrics, directions)


def false_hits(on: CaseInScene, rays: CaseRays, ids: np.ndarray, epsilon: float, most: int = 20_000) -> int:
    """How many rays hit a triangle that they pass by farther than rounding explains.

    A corner seen from the origin is rounded by ε/2 of its distance, and the projection along the ray adds a few more.
    """
    found = np.flatnonzero(ids >= 0)[:most]
    apart = oracle.passes_by(rays.origins[found], rays.directions[found], on.corners(ids[found]))
    return int((apart > ROUNDING * epsilon + 64 * np.finfo(np.float64).eps).sum())


def not_numbers(hits: RayHits) -> int:
    """How many answers hold a NaN, or an infinity where something was hit."""
    numbers = np.concatenate(
        [hits.distance[:, None], hits.barycentric_coords, hits.normal, hits.geometric_normal], axis=1
    )
    return int(
        (~np.isfinite(numbers[hits.is_hit])).any(axis=1).sum() + np.isnan(numbers[~hits.is_hit]).any(axis=1).sum()
    )


def scene_without_warnings(mesh: Mesh, **options) -> SceneData:
    """A scene of which some parts cannot be hit, or do not shine: that is what the case is about."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return SceneData(mesh, **options)


class SharedScene:
    """A scene that several cases share.

    Args:
        name: for messages.
        cases: those that share it.
    """

    def __init__(self, name: str, cases: list[Case]) -> None:
        self.name, self.cases = name, cases
        self.meshes = [case.build() for case in cases]
        self.mesh = join(self.meshes)
        self.firsts = np.cumsum([0] + [len(faces) for _, faces in self.meshes])[:-1]
        self.num_triangles = len(self.mesh[1])

    def build(self, mode: RayMode) -> dict[str, CaseInScene]:
        """The scene in a mode, by case."""
        scene = scene_without_warnings(mesh_from_arrays(*self.mesh), **mode.scene_options())
        probe = Probe(scene)
        return {
            case.name: CaseInScene(scene, probe, int(first), *arrays)
            for case, first, arrays in zip(self.cases, self.firsts, self.meshes, strict=True)
        }


def seconds_of(action, times: int = 3) -> float:
    """The shortest of some runs."""
    best = np.inf
    for _ in range(times):
        start = time.perf_counter()
        action()
        best = min(best, time.perf_counter() - start)
    return best
