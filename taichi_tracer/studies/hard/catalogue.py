"""All cases: of triangles and rays, of the rest of the renderer; and how many rays each level sends."""

from dataclasses import dataclass

from taichi_tracer.options import brdfs_of
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.studies.hard import instance_cases, path_cases
from taichi_tracer.studies.hard.case import Case, RendererCase
from taichi_tracer.studies.hard.closed_meshes import ClosedSphere, LeavingSurfaces, NestedSpheres
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
from taichi_tracer.studies.hard.shading_cases import Accumulation, Brdfs, Furnace, OppositeNormals, OwnBrdf
from taichi_tracer.studies.hard.single_triangles import FarOrigins, Grazing, InThePlane, Slivers, UnitTriangles
from taichi_tracer.studies.hard.surface_cases import SURFACES
from taichi_tracer.studies.hard.view_cases import (
    EnvironmentDirections,
    EnvironmentLight,
    ExtremeCameras,
    ImpossibleCameras,
)
from taichi_tracer.system.parts.registry import PARTS

LARGE = (*path_cases.LARGE, *instance_cases.LARGE)


@dataclass(frozen=True)
class Level:
    """How much is tried.

    Attributes:
        rays: of a case, with an accelerator.
        tests: ray-triangle tests of a scene that brute force may take, from which its number of rays follows.
        edge_rays: of the long run, at edges only, with accelerators and without fast_math.
        is_whole: whether every mode goes through every scene and every estimator; compiling that takes minutes.
        has_plain: whether the plain hierarchy is tried too; building it takes a minute for the largest scene.
        paths: the cases of light that bounces, and those that take a minute.
    """

    rays: int
    tests: int
    edge_rays: int
    is_whole: bool = True
    has_plain: bool = False
    paths: tuple[type[RendererCase], ...] = path_cases.USUAL

    def covers(self, stage: str, mode: RayMode) -> bool:
        """Whether a mode goes through a scene. In part, each scene meets the modes that most depend on it."""
        if self.is_whole:
            return True
        if mode.tries_everything:  # single triangles are asked in the same way by every intersector
            return stage != "crowd"
        return stage in ("unit", "sizes") or (stage == "crowd" and mode.precision == "f32" and mode.is_watertight)


LEVELS = {
    "quick": Level(40_000, 6_000_000, 0, is_whole=False, paths=path_cases.USUAL[:1]),
    "default": Level(400_000, 60_000_000, 4_000_000),
    "full": Level(2_000_000, 300_000_000, 100_000_000, has_plain=True, paths=(*path_cases.USUAL, *LARGE)),
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


SHORT = (ImpossibleCameras, EnvironmentDirections, Brdfs)
LONG = (Accumulation, ExtremeCameras, EnvironmentLight, OppositeNormals, *SURFACES, *instance_cases.INSTANCES)


def all_renderer_cases(
    estimators: tuple[str, ...] | None = None,
    only_short: bool = False,
    paths: tuple[type[RendererCase], ...] = (*path_cases.USUAL, *LARGE),
) -> list[RendererCase]:
    """A new one of every case of the rest of the renderer; one for each BRDF of your own.

    The furnace is tried with the named estimators, or with all.

    Args:
        only_short: leave out those that take a second or more to compile.
        paths: which cases of light that bounces, and of those that take a minute.
    """
    own = [OwnBrdf(brdf) for brdf in brdfs_of(()) if not PARTS.comes_with_package(brdf)]
    if only_short:
        return [*(case() for case in SHORT), *own]
    furnaces = [Furnace(e) for e in A2Renderer.offered() if estimators is None or e.name in estimators]
    return [*(case() for case in (*SHORT, *LONG)), *own, *furnaces, *(case() for case in paths)]
