"""The parts that a scene is made of: what its options choose, and otherwise what suits its mesh."""

import copy
from collections.abc import Sequence

from taichi_tracer.brdfs.base import Brdf
from taichi_tracer.formulas.convexity import sides_that_see_others
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.geometry import Geometry, Mesh
from taichi_tracer.intersectors.bvh import BVHRayIntersector
from taichi_tracer.intersectors.instances import TwoLevelBVH
from taichi_tracer.intersectors.wide_bvh import WideBVH
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.choice import LampChoice
from taichi_tracer.lights.mesh_light_sampler import MeshLightSampler
from taichi_tracer.options import BrdfChoice, IntersectorChoice, LampChoices
from taichi_tracer.ray_intersector import RayIntersector
from taichi_tracer.sampler import BRDF, MicrofacetBRDF
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.overrides import replaced
from taichi_tracer.system.registry import PARTS

FEW_PRIMITIVES = 20_000  # up to so many, a picture is there before the wide hierarchy would be compiled
FEW_LAMPS = 64  # up to so many, a choice by power alone takes less time than it loses to a hierarchy


def blockers_of(mesh: Mesh, intersector, triangle_test: str | TriangleTest) -> str:
    """What a ray that leaves a surface can hit, see ``Effects``. A student's code may find more: it is always asked."""
    test = PARTS.find("triangle test", triangle_test)
    if replaced(intersector) or not test.solve.__module__.startswith("taichi_tracer."):
        return "all"
    if mesh.placed is not None:
        return "all"
    if len(mesh.spheres) > 0:
        return "backs" if len(mesh.spheres) == 1 and len(mesh.faces) == 0 else "all"
    return sides_that_see_others(mesh.vertices, mesh.faces)


def intersector_of(chosen: IntersectorChoice | None, mesh: Mesh) -> type[RayIntersector] | RayIntersector:
    """The intersector of a scene: its class, or an object without a geometry.

    The wide hierarchy is faster in scenes of many primitives; the binary one takes half of the time to compile. The
    wide one asks no ``intersect_triangle``: where a student has replaced a method, the binary one runs.
    """
    usual = "bvh" if mesh.num_primitives <= FEW_PRIMITIVES else "wide_bvh"
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
