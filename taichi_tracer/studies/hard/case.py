"""What a case is: a mesh, rays, and what must hold of the answers; the scene that several cases share; and the modes.

Meshes are (vertices, faces), in float64 numbers that f32 holds exactly: every precision meets the same triangles.
"""

import timeit
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import taichi as ti

from taichi_tracer.contracts.lab import WHOLE, Rows, bound
from taichi_tracer.files.meshes import mesh_from_arrays
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.triangles import stable_normal, unit
from taichi_tracer.ray import Ray, RayHits, offset_origin
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies.hard import oracle
from taichi_tracer.system import runtime
from taichi_tracer.system.parts import PARTS

# ── meshes ──


def unit_rows(vectors: np.ndarray) -> np.ndarray:
    """(n, 3) vectors of length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


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


# ── modes and their promises ──


OWN_TEST = "own"  # in place of a triangle test, where the intersector has an ``intersect_triangle`` of its own
REFERENCE = "brute_force"  # the intersector that all others must equal


@dataclass(frozen=True)
class RayMode:
    """One way to intersect rays.

    Attributes:
        triangle_test: its name, or ``OWN_TEST``.
    """

    triangle_test: str
    precision: str
    fast_math: bool
    intersector: str

    @property
    def tries_everything(self) -> bool:
        """Whether each ray is tried against each triangle, so that far fewer rays fit into the same time."""
        intersector = PARTS.find("intersector", self.intersector)
        cls = intersector if isinstance(intersector, type) else type(intersector)
        return cls.search is RayIntersector.search

    def scene_options(self) -> dict:
        """What ``SceneData`` needs to intersect rays in this way."""
        options = {"intersector": self.intersector}
        return options if self.triangle_test == OWN_TEST else options | {"triangle_test": self.triangle_test}

    @property
    def is_watertight(self) -> bool:
        """Whether the mode promises that no ray passes between two triangles."""
        return self.triangle_test not in ZERO

    @property
    def epsilon(self) -> float:
        """The distance from 1 to the next number in the precision."""
        return float(np.finfo(np.float64 if self.precision == "f64" else np.float32).eps)

    def __str__(self) -> str:
        rest = " fast_math" * self.fast_math
        return f"{self.triangle_test} {self.precision} {self.intersector}{rest}"


DEFAULT = RayMode("watertight", "f32", False, "wide_bvh")  # what runs if nobody chooses and the scene is large


# Counts that a case may find. None of them is measured against a tolerance that a mode could choose.
COUNTS = {
    "edge_leaks": "rays at an edge that pass through a closed surface",
    "vertex_leaks": "rays at a vertex that pass through a closed surface",
    "misses": "rays at the inside of a triangle that do not hit it",
    "false_hits": "hits whose ray passes the triangle by more than rounding explains",
    "self_hits": "rays that leave a triangle and hit it again",
    "nan": "answers that are not numbers",
    "wrong": "answers that are wrong in another way: the triangle, the side, the window of t",
    "differs": "answers that are not those of brute force, bit for bit",
    "slow": "illegal rays that take more than 2.5 times as long as others",
}


# In f32, t is computed once more in f64 at a hit. In f64 there is nothing wider to turn to, nor in f32 on a backend
# without f64: a sliver's aspect, or one over the angle of a grazing ray, multiplies the rounding of the vertices'
# differences.
# Class of rays → the largest relative error of t, in ε of the precision.
T_ERROR = {"t_unit": 4, "t_sliver": 4, "t_grazing": 4, "t_far": 4}
T_ERROR_NOT_WIDENED = {"t_unit": 32, "t_sliver": 1e6, "t_grazing": 1e6, "t_far": 64}
ZERO = {"moller_trumbore": frozenset({"nan", "wrong", "differs", "slow"})}
# Without f64, the sign of an edge function is unknown where both of its products round to the same number.
NEED_F64 = frozenset({"edge_leaks", "vertex_leaks", "false_hits"})


def promises_of(mode: RayMode) -> dict[str, float]:
    """Finding → the largest value that a mode promises on the backend that runs, in every case.

    What is not named is reported, and never a failure. A triangle test without a line in ``ZERO`` must never be wrong.
    """
    if mode.fast_math:
        return {}  # the compiler may assume that there is no NaN and no rounding: nothing can be promised
    zero = ZERO.get(mode.triangle_test, frozenset(COUNTS))
    if not runtime.can("f64"):
        zero -= NEED_F64
    if not mode.is_watertight and not runtime.can("separate roundings"):
        zero -= {"wrong"}  # a product and a sum with one rounding: u may be below 0 on an edge
    t_error = T_ERROR if runtime.can_widen() else T_ERROR_NOT_WIDENED
    return dict.fromkeys(zero, 0.0) | {name: factor * mode.epsilon for name, factor in t_error.items()}


# ── cases ──


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
        """Findings, named as in ``COUNTS``, and the number of rays they are out of where it matters."""

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


RENDERER_CASES: list[RendererCase] = []  # in the order of their definition


def renderer_case(name: str, cost: int = QUICK) -> Callable:
    """Make the function that follows the ``check`` of a ``RendererCase``."""

    def add(check: Callable[[CaseTally, float], None]) -> Callable[[CaseTally, float], None]:
        RENDERER_CASES.append(RendererCase(name, check, cost))
        return check

    return add


@ti.func
def leave(geometry: ti.template(), triangle_id, barycentrics, d):
    """Where a ray starts that leaves a triangle at (u, v), on the side that its direction points to."""
    v0, v1, v2 = geometry.triangle(triangle_id)
    p, error = geometry.position(barycentrics.x, barycentrics.y, v0, v1, v2, geometry.thinness[triangle_id])
    n = unit(stable_normal(v0, v1, v2))
    return offset_origin(p, error, ti.select(tm.dot(d, n) < 0, -n, n))


@ti.func
def meet(intersector: ti.template(), origin, direction, triangle_id):
    """t of a ray on a triangle alone, as exact as that of a nearest hit; ∞ where it misses."""
    ray = Ray(origin=origin, direction=direction)
    hit = intersector.with_exact_distance(ray, intersector.intersect_triangle(ray, triangle_id), 0.0, tm.inf)
    return ti.select(hit.is_hit, hit.distance, tm.inf)


class CaseInScene:
    """A case in the scene of its stage, in one mode: what the judge can ask."""

    def __init__(self, scene: SceneData, left: Rows, met: Rows, first: int, case: Case) -> None:
        self.scene, self.left, self.met, self.first = scene, left, met, first
        self.vertices, self.faces = case.vertices, case.faces
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
        return self.met(rays.origins, rays.directions, ids + self.first)

    def self_hits(self, ids: np.ndarray, barycentrics: np.ndarray, directions: np.ndarray) -> dict[str, int]:
        """How many rays that leave own triangles meet them again; NaN is an origin that is no point."""
        origins = self.left(ids + self.first, barycentrics, directions)
        again = self.meet(CaseRays(origins, directions), ids)
        no_origin = ~np.isfinite(origins).all(axis=1)
        return {"self_hits": int(np.isfinite(again).sum()), "self_hit_rays": len(ids), "nan": int(no_origin.sum())}


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


class SharedScene:
    """A scene that several cases share.

    Args:
        name: for messages.
        cases: those that share it.
    """

    def __init__(self, name: str, cases: list[Case]) -> None:
        self.name, self.cases = name, cases
        self.mesh = join([case.build() for case in cases])
        self.firsts = np.cumsum([0] + [len(case.faces) for case in cases])[:-1]
        self.num_triangles = len(self.mesh[1])

    def build(self, mode: RayMode) -> dict[str, CaseInScene]:
        """The scene in a mode, by case."""
        scene = SceneData(mesh_from_arrays(*self.mesh), **mode.scene_options())
        left = Rows(bound(leave, scene.geometry), (WHOLE, 2, 3), (3,))
        met = Rows(bound(meet, scene.ray_intersector), (3, 3, WHOLE), (1,))
        placed = zip(self.cases, self.firsts, strict=True)
        return {case.name: CaseInScene(scene, left, met, int(first), case) for case, first in placed}


def seconds_of(action: Callable[[], object], times: int = 3) -> float:
    """The shortest of some runs."""
    return min(timeit.repeat(action, number=1, repeat=times))
