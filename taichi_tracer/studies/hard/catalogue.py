"""All cases: of triangles and rays, of the rest of the renderer; and how many rays each level sends."""

from dataclasses import dataclass
from functools import partial

from taichi_tracer.options import brdfs_of
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.studies.hard import instance_cases, light_cases, view_cases  # noqa: F401 (their cases)
from taichi_tracer.studies.hard.case import EVERYWHERE, LARGE, QUICK, RENDERER_CASES, USUAL, Case, RendererCase
from taichi_tracer.studies.hard.closed_meshes import ClosedSphere, LeavingSurfaces, NestedSpheres
from taichi_tracer.studies.hard.light_cases import OF_BRDFS, furnace, own_brdf
from taichi_tracer.studies.hard.many_triangles import (
    AxisParallel,
    Damaged,
    DirectionLengths,
    Duplicates,
    IllegalRays,
    Lattice,
    OneCentroid,
    Windows,
)
from taichi_tracer.studies.hard.modes import RayMode
from taichi_tracer.studies.hard.single_triangles import FarOrigins, Grazing, InThePlane, Slivers, UnitTriangles
from taichi_tracer.system.parts import PARTS


@dataclass(frozen=True)
class Level:
    """How much is tried.

    Attributes:
        rays: of a case, with an accelerator.
        tests: ray-triangle tests of a scene that brute force may take, from which its number of rays follows.
        edge_rays: of the long run, at edges only, with accelerators and without fast_math.
        is_whole: whether every mode goes through every scene and every estimator; compiling that takes minutes.
        has_plain: whether the plain hierarchy is tried too; building it takes a minute for the largest scene.
    """

    rays: int
    tests: int
    edge_rays: int
    is_whole: bool = True
    has_plain: bool = False

    def covers(self, stage: str, mode: RayMode) -> bool:
        """Whether a mode goes through a scene. In part, each scene meets the modes that most depend on it."""
        if self.is_whole:
            return True
        if mode.tries_everything:  # single triangles are asked in the same way by every intersector
            return stage != "crowd"
        return stage in ("unit", "sizes") or (stage == "crowd" and mode.precision == "f32" and mode.is_watertight)


LEVELS = {
    "quick": Level(40_000, 6_000_000, 0, is_whole=False),
    "default": Level(400_000, 60_000_000, 4_000_000),
    "full": Level(2_000_000, 300_000_000, 100_000_000, has_plain=True),
}


def embree_sphere() -> ClosedSphere:
    """The sphere of Embree's watertightness test (kernels/verify): 159,200 triangles far away from the origin."""
    return ClosedSphere(
        "159,200 triangles at (148376, 1234, -223423)", "crowd", 200.0, (148376, 1234, -223423), 400, 200
    )


def all_cases() -> list[Case]:
    """A new one of every case."""
    return [
        ClosedSphere("closed sphere at 0", "unit", 8.0, (0, 0, 0)),
        ClosedSphere("closed sphere at 1e2", "unit", 4.0, (100, -33, 14)),
        ClosedSphere("closed sphere at 1e4", "sizes", 4.0, (1e4, -3333, 1429)),
        ClosedSphere("closed sphere at 1e6", "sizes", 4.0, (1e6, -333333, 142857)),
        embree_sphere(),
        NestedSpheres(),
        LeavingSurfaces(),
        Lattice(),
        AxisParallel(),
        InThePlane(),
        UnitTriangles(),
        Slivers(),
        Grazing(),
        FarOrigins(),
        DirectionLengths(),
        Windows(),
        IllegalRays(),
        Damaged(),
        Duplicates(),
        OneCentroid(),
    ]


def renderer_cases(level: str, precision: str) -> list[RendererCase]:
    """The cases of the rest of the renderer that a level tries in a precision; one for each BRDF of your own.

    The furnace is tried with every estimator of direct light; in the quick level, with one, and in f32 only.
    """
    most = {"quick": QUICK if precision == "f32" else EVERYWHERE, "default": USUAL, "full": LARGE}[level]
    own = [brdf for brdf in brdfs_of(()) if not PARTS.comes_with_package(brdf)]
    estimators = [e.name for e in A2Renderer.offered() if most >= USUAL or e.name == "brdf"]
    cases = [case for case in RENDERER_CASES if case.cost <= most]
    cases += [RendererCase(f"BRDF {brdf.name}: {OF_BRDFS}", partial(own_brdf, brdf)) for brdf in own]
    if most > EVERYWHERE:
        cases += [RendererCase(f"furnace: {name}", partial(furnace, name)) for name in estimators]
    return cases
