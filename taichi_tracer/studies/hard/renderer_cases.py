"""All cases of the rest of the renderer."""

from taichi_tracer.assignments import A2Renderer
from taichi_tracer.scene_parts import brdfs_of
from taichi_tracer.studies.hard import path_cases
from taichi_tracer.studies.hard.case import RendererCase
from taichi_tracer.studies.hard.shading_cases import Accumulation, Brdfs, Furnace, OppositeNormals, OwnBrdf
from taichi_tracer.studies.hard.view_cases import (
    EnvironmentDirections,
    EnvironmentLight,
    ExtremeCameras,
    ImpossibleCameras,
)
from taichi_tracer.system.registry import PARTS


def all_cases(
    estimators: tuple[str, ...] | None = None,
    only_short: bool = False,
    paths: tuple[type[RendererCase], ...] = (*path_cases.USUAL, *path_cases.LARGE),
) -> list[RendererCase]:
    """A new one of every case; the furnace with the named estimators, or with all; one for each BRDF of your own.

    Args:
        only_short: leave out those that take a second or more to compile.
        paths: which cases of light that bounces.
    """
    own = [OwnBrdf(brdf) for brdf in brdfs_of(()) if not PARTS.comes_with_package(brdf)]
    if only_short:
        return [*(case() for case in SHORT), *own]
    furnaces = [Furnace(e) for e in A2Renderer.offered() if estimators is None or e.name in estimators]
    return [*(case() for case in (*SHORT, *LONG)), *own, *furnaces, *(case() for case in paths)]


SHORT = (ImpossibleCameras, EnvironmentDirections, Brdfs, Accumulation)
LONG = (ExtremeCameras, EnvironmentLight, OppositeNormals)
