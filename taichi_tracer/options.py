"""The options of a scene and of a renderer: their names, types, defaults and meaning, and the parts that they choose.

Whatever makes a scene or a renderer takes its options as ``**options: "Unpack[SceneOptions]"``. An editor and a type
checker then know every name and type, as if they stood in the signature; with ``with_options``, so does ``help``.
"""

from __future__ import annotations  # the types of options are shown as they are written here

import copy
import inspect
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar, cast

from numpy.typing import ArrayLike

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.environment import Background, Environment
from taichi_tracer.formulas.convexity import sides_that_see_others
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Geometry, Mesh
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.intersectors.instances import TwoLevelBVH
from taichi_tracer.intersectors.wide_bvh import WideBVH
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.choice import LampChoice
from taichi_tracer.lights.mesh_light_sampler import MeshLightSampler
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.sampler import BRDF, MicrofacetBRDF, Sampler, UniformSampler
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, check_names
from taichi_tracer.system.parts import PARTS, replaced

if TYPE_CHECKING:
    from taichi_tracer.integrators.base import Integrator

IntersectorChoice = str | type[RayIntersector] | RayIntersector
BrdfChoice = str | Brdf | type[Brdf]
LampChoices = str | LampChoice | type[LampChoice]
EnvironmentChoice = ArrayLike | Path | Environment | None
BackgroundChoice = ArrayLike | Path | Background | None
CameraChoice = ProjectiveCamera | type[ProjectiveCamera] | str | None

Options = TypeVar("Options", bound=Mapping[str, Any])
Function = TypeVar("Function", bound=Callable)


class SceneOptions(TypedDict, total=False):
    """The options of a scene.

    intersector: the name of a registered intersector, a class that derives from ``RayIntersector``, or an object of
        such a class that has no geometry yet. None takes "bvh" for up to 1,000 primitives (20,000 on GPUs),
        and "wide_bvh" for more.
    triangle_test: the name of a registered triangle test, or a ``TriangleTest``.
    view: camera parameters that show the scene, as for ``camera.make_camera``. With None, they are computed: a
        three-quarter view from above, which shows everything. ``load_scene_data`` takes the camera of the file, or
        that of the course for some shipped meshes; of other files, the one that shows most, see
        ``formulas.first_view``: a room from its open side, for example.
    environment: light from far away: a shipped name, the path of an image, an (h, w, 3) array, an ``Environment``,
        or None. "file", for ``load_scene_data``, takes what the file says; only .xml can say it.
    effects: "scene" compiles the effects that the scene calls for; "all" compiles every effect, for comparison.
    background: what stands behind everything in a picture: a ``Background``, a colour, or None; "file" as above.
    brdfs: BRDFs, by name or as objects. They take precedence over the registered BRDFs.
    lights: lights other than the environment, by name or as objects.
    smooth: whether corners without a normal get a smooth one; or the angle in degrees from which an edge stays sharp,
        see ``geometry.smoothed``. True is 30 degrees.
    up_axis: the axis that points upwards in the scene, "y" or "z". The computed view has this axis upright, and the
        zenith of the environment is in this direction. The coordinates of the scene stay as they are. "file", for
        ``load_scene_data``, takes "z" where a mesh stands on a flat base then, and a note says so.
    lamp_choice: how a sample of the light chooses among the surfaces with Ke > 0: the name of a registered
        ``LampChoice``, or one: "area", "power" or "hierarchy". None takes "power" for up to 64 of them, and
        "hierarchy" for more.
    two_sided_lamps: whether triangles with Ke > 0 emit from both sides; if not, from their front only (A3-1).
    ground: whether a large diffuse square lies under everything; then what has no material of its own is as grey as it.
    instances: how meshes in several places are kept, see ``instances.resolve_instances``: "auto", "shared" or "copied".
    """

    intersector: IntersectorChoice | None
    triangle_test: str | TriangleTest
    view: dict[str, Any] | None
    environment: EnvironmentChoice
    effects: str
    background: BackgroundChoice
    brdfs: Sequence[BrdfChoice]
    lights: Sequence[str | Light | type[Light]]
    smooth: bool | float
    up_axis: str
    lamp_choice: LampChoices | None
    two_sided_lamps: bool
    ground: bool
    instances: str


SCENE_DEFAULTS: SceneOptions = {
    "intersector": None,
    "triangle_test": "watertight",
    "view": None,
    "environment": None,
    "effects": "scene",
    "background": None,
    "brdfs": (),
    "lights": (),
    "smooth": False,
    "up_axis": "y",
    "lamp_choice": None,
    "two_sided_lamps": False,
    "ground": False,
    "instances": "auto",
}


class RendererOptions(TypedDict, total=False):
    """The options of a renderer, beside the size of its picture.

    camera: a camera object; then its size is the size of the picture. Or the name or the class of a camera: the
        renderer makes one that shows the scene. None takes the camera of the scene.
    jitter: whether eye rays pass through a random point of their pixel (A2-1); None takes the default of the class.
    sampler: the name of a registered sampler, or a ``Sampler``; None is one sequence for each pixel, and two sequences
        for each pixel of an adaptive picture. If it is a ``UniformSampler``, the estimator ``uniform`` takes its
        directions from it.
    seed: the seed of the random numbers; the same seed gives the same picture.
    first_sample: the index of the first sample, so that disjoint ranges of samples can be rendered separately and then
        merged.
    crop: the pixels that take samples, see ``Film``.
    adaptive: whether pixels take samples in proportion to their standard deviation, see ``picture.adaptive``; None lets
        a picture do so that is rendered to an error or for a time, if it is long and this is predicted to pay.
    integrator: what to render, by name or as an object; None is the first integrator that the class offers.
    """

    camera: CameraChoice
    jitter: bool | None
    sampler: str | Sampler | type[Sampler] | UniformSampler | type[UniformSampler] | None
    seed: int
    first_sample: int
    crop: tuple[int, int, int, int] | None
    adaptive: bool | None
    integrator: str | Integrator | type[Integrator] | Enum | None


RENDERER_DEFAULTS: RendererOptions = {
    "camera": None,
    "jitter": None,
    "sampler": None,
    "seed": 0,
    "first_sample": 0,
    "crop": None,
    "adaptive": None,
    "integrator": None,
}


def all_options(caller: str, given: Options, defaults: Options) -> Options:
    """The given options, and the defaults of the others.

    Raises:
        TypeError: one of the names is no option.
    """
    check_names(f"option of {caller}", given, defaults)
    return cast(Options, {**defaults, **given})


def with_options(options: type, defaults: Mapping[str, Any], **other: Any) -> Callable[[Function], Function]:
    """A decorator that lets ``help`` and ``inspect.signature`` show single options in place of ``**options``.

    Args:
        options: the TypedDict of the options; its docstring is added to that of the function.
        defaults: the default of each option. other: the defaults that are different for this function.
    """

    def show(function: Function) -> Function:
        signature = inspect.signature(function)
        named = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        only_by_name = inspect.Parameter.KEYWORD_ONLY
        shown = [
            inspect.Parameter(name, only_by_name, default=default, annotation=types[name].__forward_arg__)
            for name, default in {**defaults, **other}.items()
        ]
        parameters = [
            p if p.name == "self" else p.replace(annotation=AsWritten(p.annotation)) for p in [*named, *shown]
        ]
        returns = AsWritten(signature.return_annotation)
        function.__signature__ = signature.replace(parameters=parameters, return_annotation=returns)  # type: ignore[attr-defined]
        function.__doc__ = "\n\n".join(inspect.cleandoc(text or "") for text in (function.__doc__, options.__doc__))
        return function

    types = options.__annotations__
    return show


class AsWritten(str):
    """An annotation that ``help`` and ``inspect.signature`` show as it stands in the file."""

    def __repr__(self) -> str:
        return str(self)


# Up to so many, the time to compile the wide hierarchy may be longer than what it saves, on CPUs and on other backends.
FEW_PRIMITIVES, FEW_ON_GPUS = 1_000, 20_000
FEW_LAMPS = 64  # up to so many, a choice by power alone takes less time than it loses to a hierarchy


def blockers_of(mesh: Mesh, intersector, triangle_test: str | TriangleTest) -> str:
    """What a ray that leaves a surface can hit, see ``Effects``. A student's code may find more: it is always asked."""
    test = PARTS.find("triangle test", triangle_test)
    is_own = replaced(intersector) or not test.solve.__module__.startswith("taichi_tracer.")
    if is_own or mesh.placed is not None:
        return "all"
    if len(mesh.spheres) > 0:
        return "backs" if len(mesh.spheres) == 1 and len(mesh.faces) == 0 else "all"
    return sides_that_see_others(mesh.vertices, mesh.faces)


def intersector_of(chosen: IntersectorChoice | None, mesh: Mesh) -> type[RayIntersector] | RayIntersector:
    """The intersector of a scene: its class, or an object without a geometry.

    The wide hierarchy is 1.2 to 2 times as fast; the binary one takes half of the time to compile. The wide one asks no
    ``intersect_triangle``: where a student has replaced a method, of all intersectors or of the binary one, that runs.
    """
    few = FEW_PRIMITIVES if runtime.ensure().arch == "cpu" else FEW_ON_GPUS
    usual = "bvh" if mesh.num_primitives <= few or replaced(BVHRayIntersector) else "wide_bvh"
    found = PARTS.find("intersector", usual if chosen is None else chosen)
    return BVHRayIntersector if found is WideBVH and replaced(WideBVH) else found


def knows_instances(chosen: IntersectorChoice | None) -> bool:
    """Whether there is a form of an intersector for objects in several places: of the hierarchies, as shipped."""
    found = BVHRayIntersector if chosen is None else PARTS.find("intersector", chosen)
    return found in (BVHRayIntersector, WideBVH) and not replaced(found)


def lamp_choice_of(chosen: LampChoices | None, mesh: Mesh) -> LampChoice:
    """A lamp choice of a scene's own, because its tables belong to the scene; None asks for one that suits the mesh.

    If a method of ``MeshLightSampler`` is replaced, it takes the place of "area", and of a choice that is not given.
    """
    if replaced(MeshLightSampler) and chosen in (None, "area"):
        return MeshLightSampler()
    usual = "power" if mesh.emits().sum() <= FEW_LAMPS else "hierarchy"
    return copy.copy(PARTS.find("lamp choice", usual if chosen is None else chosen))


def lights_of(mesh: Mesh) -> list[Light]:
    """The lights that stand in the file of a mesh."""
    return [type(PARTS.find("light", name))(**values) for name, values in mesh.lights]


def brdfs_of(chosen: Sequence[BrdfChoice]) -> list[Brdf]:
    """The BRDFs that a scene knows. If several of them describe a material, the last one in this list is used.

    The order is: the registered BRDFs in the order of their registration; then those of the handouts, ``BRDF`` and
    ``MicrofacetBRDF``, if one of their methods was replaced; then the BRDFs that were chosen for this scene, in reverse
    order.
    """
    own = [PARTS.find("BRDF", one) for one in chosen]
    handouts = [handout() for handout in (BRDF, MicrofacetBRDF) if replaced(handout)]
    return [*(brdf for brdf in PARTS.all("BRDF") if brdf not in own), *handouts, *reversed(own)]


def make_intersector(
    chosen: type[RayIntersector] | RayIntersector, geometry: Geometry, triangle_test: str | TriangleTest
) -> RayIntersector:
    """The intersector of a geometry, made from a class or from an object without a geometry."""
    if not isinstance(chosen, type):
        if chosen.geometry is not None:
            raise InputError(f"intersector: this {type(chosen).__name__} belongs to another scene: make a new one")
        chosen.bind(geometry, triangle_test)
        return chosen
    return (TwoLevelBVH if geometry.effects.instances else chosen)(geometry, triangle_test)
