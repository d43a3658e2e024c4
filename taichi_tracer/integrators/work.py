"""Maps of work: what a sample of each pixel costs, and where its work is lost.

A map measures another integrator, such as a view, an estimator or a kind of paths. It takes the same samples with the
same code, and counts what this code does: it observes the parts of the scene (``system.observed``). Pictures that are
no maps use the parts themselves, and pay nothing.
"""

import copy
from collections.abc import Callable
from functools import partial
from typing import Any

import taichi as ti
from taichi.lang import impl

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.system.compile_time import compile_time, variable
from taichi_tracer.system.observed import after, observed, observed_scene
from taichi_tracer.system.parts import register

# Methods of an intersector that enter a node or try a box; those that try a triangle
# or a sphere; and methods of a surface to one of which each direction that is sampled goes.
ENTERING = "met_children", "node_interval"
TRYING = "intersect_triangle", "try_corners", "solved", "sphere_candidate", "ellipsoid_in"
SCATTERING = "eval_cosine", "weight"


@ti.data_oriented
class WorkTally:
    """What one sample does, counted in variables of the kernel that is being compiled."""

    @compile_time
    def begin(self) -> None:
        """Begin a sample."""
        self.nodes, self.primitives, self.blocked, self.below = (impl.expr_init(0) for _ in range(4))
        self.x, self.y, self.z = (impl.expr_init(0.0) for _ in range(3))  # of the last direction

    @ti.func
    def node(self):
        """A node of a hierarchy was entered, or a box was tried."""
        self.nodes += 1

    @ti.func
    def primitive(self):
        """A triangle or a sphere was tried."""
        self.primitives += 1

    @ti.func
    def shadow_ray(self, intersector, is_blocked, ray, t_max):
        """A shadow ray was sent: ``is_occluded`` of an intersector."""
        if is_blocked:
            self.blocked += 1

    @ti.func
    def direction(self, normal, w_i):
        """A direction was sampled; if several methods get the same one, it counts once."""
        is_new = w_i.x != self.x or w_i.y != self.y or w_i.z != self.z
        if is_new and tm.dot(normal, w_i) <= 0:
            self.below += 1
        self.x, self.y, self.z = w_i.x, w_i.y, w_i.z

    @ti.func
    def scattered(self, surface, value, w_i):
        """A surface got a direction, for one of ``SCATTERING``. A mirror's is no sample."""
        if not surface.is_delta():
            self.direction(surface.normal, w_i)


@ti.data_oriented
class WorkMap(Integrator):
    """One map: a number per sample of each pixel. The picture has its mean in all three channels.

    Args:
        name, label: as for ``Integrator``.
        unit: of the number.
        number: the name of the number of a ``WorkTally``; None shows the standard error of the picture instead.
    """

    what = "map"

    def __init__(self, name: str, label: str, unit: str, number: str | None = None) -> None:
        self.name, self.label, self.unit, self.number = name, label, unit, number


register(WorkMap("nodes", "Nodes entered", "nodes entered per sample", "nodes"))
register(WorkMap("triangles", "Triangles tried", "triangles and spheres tried per sample", "primitives"))
register(WorkMap("blocked", "Shadow rays blocked", "shadow rays blocked per sample", "blocked"))
register(WorkMap("below_horizon", "Below the horizon", "directions below the horizon per sample", "below"))
register(WorkMap("standard_error", "Standard error", "standard error of the mean, as radiance"))


def counted(parts: Any, number: str) -> Any:
    """The ``SampleParts``, observed: the film gets a number of what the sample did."""
    tally = WorkTally()
    scene = counted_scene(parts.scene, tally)
    eye_rays = copy.copy(parts.eye_rays)
    eye_rays.intersector = scene.ray_intersector
    sampler = observed(parts.sampler, {"start": partial(noting, tally.begin)})
    film = observed(parts.film, {"record": partial(recording, tally, number)})
    return parts._replace(scene=scene, eye_rays=eye_rays, sampler=sampler, film=film)


def counted_scene(scene: Any, tally: WorkTally) -> Any:
    """A copy of the part of a scene that kernels use, whose rays, surfaces and lights are counted."""

    def sampled(lights, found, x, n, xi):
        """``sample`` of lights: below the horizon, no surface is asked for the value of this direction."""
        tally.direction(n, found[0])

    search = dict.fromkeys(ENTERING, partial(noting, tally.node)) | dict.fromkeys(
        TRYING, partial(noting, tally.primitive)
    )
    observers = {
        "ray_intersector": search | {"is_occluded": after(tally.shadow_ray)},
        "surface": dict.fromkeys(SCATTERING, after(tally.scattered)),
        "lights": {"sample": after(sampled)},
    }
    return observed_scene(scene, observers)


def noting(act: Callable, part: Any, call: Callable, *of: Any) -> Any:
    """A method of a part begins; it is noted before."""
    act()
    return call(*of)


def recording(
    tally: WorkTally, number: str, film: Any, record: Callable, x: Any, y: Any, value: Any, index: Any
) -> Any:
    """A sample ends; the film gets a number of its tally."""
    return record(x, y, variable(tm.vec3(ti.cast(getattr(tally, number), float))), index)
