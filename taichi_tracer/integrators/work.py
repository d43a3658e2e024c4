"""Maps of work: what a sample of each pixel costs, and where its work is lost.

A map measures another integrator, such as a view, an estimator or a kind of paths. It takes the same samples with the
same code, and counts what this code does: parts of the scene are copied, and methods of the copies count before they
call the method of the original. Pictures that are no maps use the originals, and pay nothing.
"""

import copy
import functools
import inspect
from collections.abc import Callable
from typing import Any

import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.brdfs.surface import Surface
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.system.registry import register
from taichi_tracer.system.seams import in_kernels

SCATTERING = "eval_cosine", "weight"  # methods of a surface: each direction that is sampled goes to one of them


@ti.data_oriented
class Tally:
    """What one sample does, counted in variables of the kernel that is being compiled."""

    def __init__(self) -> None:
        self.nodes, self.primitives, self.shadows, self.blocked, self.below = (impl.expr_init(0) for _ in range(5))
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
    def shadow_ray(self, is_blocked):
        """A shadow ray was sent."""
        self.shadows += 1
        if is_blocked:
            self.blocked += 1

    @ti.func
    def direction(self, normal, w_i):
        """A direction was sampled; if several methods get the same one, it counts once."""
        is_new = w_i.x != self.x or w_i.y != self.y or w_i.z != self.z
        if is_new and tm.dot(normal, w_i) <= 0:
            self.below += 1
        self.x, self.y, self.z = w_i.x, w_i.y, w_i.z


@ti.data_oriented
class WorkMap(Integrator):
    """One map: a number per sample of each pixel. The picture has its mean in all three channels.

    Args:
        name, label: as for ``Integrator``.
        unit: of the number.
        number: a function that gives the number from a ``Tally``, while a kernel is compiled; None for a map that is
            not the mean of such numbers.
        is_timed: whether the number is the time that a sample takes.
        shows_error: whether the map shows the standard error of the picture that is measured.
    """

    what = "map"

    def __init__(
        self,
        name: str,
        label: str,
        unit: str,
        number: Callable[[Tally], Any] | None = None,
        is_timed: bool = False,
        shows_error: bool = False,
    ) -> None:
        self.name, self.label, self.unit, self.number = name, label, unit, number
        self.is_timed, self.shows_error = is_timed, shows_error

    @in_kernels
    def measure(self, integrator: Integrator, scene: Any, ray: Any, rng: Any) -> Any:
        """One sample of the integrator along the ray: the number that is counted, or the radiance."""
        tally = None if self.number is None else Tally()
        parts = scene if tally is None else counted_scene(scene, tally)
        hit = impl.expr_init(parts.ray_intersector.query_segment(ray, 0.0, tm.inf))
        value = impl.expr_init(integrator.radiance(parts, ray, hit, rng))
        return value if self.number is None or tally is None else _grey(self.number(tally))


@ti.func
def _grey(number):
    return tm.vec3(ti.cast(number, float))


@ti.data_oriented
class Measurement:
    """A map of one integrator: what kernels get."""

    def __init__(self, map_: WorkMap, integrator: Integrator) -> None:
        self.map, self.integrator, self.samples_lights = map_, integrator, integrator.samples_lights

    @in_kernels
    def radiance(self, scene, ray, hit, rng):
        """One sample; see ``WorkMap.measure``. The ray is traced here, so that its work counts, too."""
        return self.map.measure(self.integrator, scene, ray, rng)


register(WorkMap("nodes", "Nodes entered", "nodes entered per sample", lambda tally: tally.nodes))
register(
    WorkMap("triangles", "Triangles tried", "triangles and spheres tried per sample", lambda tally: tally.primitives)
)
register(WorkMap("blocked", "Shadow rays blocked", "shadow rays blocked per sample", lambda tally: tally.blocked))
register(
    WorkMap("below_horizon", "Below the horizon", "directions below the horizon per sample", lambda tally: tally.below)
)
register(WorkMap("standard_error", "Standard error", "standard error of the mean, as radiance", shows_error=True))
register(WorkMap("seconds", "Seconds", "seconds per sample on one core", is_timed=True))


# ── parts that count ──


def counted_scene(scene: Any, tally: Tally) -> Any:
    """A copy of the part of a scene that kernels use, whose rays and surfaces are counted."""
    found = copy.copy(scene)
    found.ray_intersector = counted_intersector(scene.ray_intersector, tally)
    cls = type(scene)
    make = cls.surface_at

    @functools.wraps(make)
    def surface_at(self, ray, hit):
        """The surface that a ray hit; directions that are sampled on it are counted."""
        surface = make(self, ray, hit)
        surface.__class__ = type("CountedSurface", (Surface,), {name: sampled(name, tally) for name in SCATTERING})
        return surface

    found.__class__ = type(f"Counted{cls.__name__}", (cls,), {"surface_at": in_kernels(surface_at)})
    found.lights = copy.copy(scene.lights)
    lights = type(scene.lights)
    found.lights.__class__ = type(f"Counted{lights.__name__}", (lights,), {"sample": sampled_lights(lights, tally)})
    return found


def counted_intersector(intersector: Any, tally: Tally) -> Any:
    """A copy of an intersector that counts nodes, primitives and shadow rays."""
    cls = type(intersector)
    counters = {"met_children": tally.node, "node_interval": tally.node}
    counters |= dict.fromkeys(("try_corners", "try_triangle", "sphere_candidate"), tally.primitive)
    members = {name: counted(cls, name, count) for name, count in counters.items() if hasattr(cls, name)}
    original = inspect.getattr_static(cls, "is_occluded")

    @functools.wraps(original)
    def is_occluded(self, ray, t_max):
        """Whether anything lies on the ray before t_max; the answer is counted."""
        is_blocked = impl.expr_init(original.__get__(self, type(self))(ray, t_max))
        tally.shadow_ray(is_blocked)
        return is_blocked

    found = copy.copy(intersector)
    found.__class__ = type(f"Counted{cls.__name__}", (cls,), members | {"is_occluded": in_kernels(is_occluded)})
    return found


def counted(cls: type, name: str, count: Callable[[], None]) -> Callable:
    """The method of a class, which counts before it runs."""
    original = inspect.getattr_static(cls, name)

    @functools.wraps(original)
    def method(self, *arguments, **named):
        """The method of the original, counted."""
        count()
        return original.__get__(self, type(self))(*arguments, **named)

    return in_kernels(method)


def sampled(name: str, tally: Tally) -> Callable:
    """A method of a surface that gets a direction, which is counted. A mirror's direction is no sample."""
    original = inspect.getattr_static(Surface, name)

    @functools.wraps(original)
    def method(self, w_i):
        """The method of the surface, counted."""
        _note_direction(tally, self, w_i)
        return original.__get__(self, type(self))(w_i)

    return in_kernels(method)


@ti.func
def _note_direction(tally: ti.template(), surface, w_i):
    if not surface.is_delta():
        tally.direction(surface.normal, w_i)


def sampled_lights(cls: type, tally: Tally) -> Callable:
    """``SceneLights.sample``, whose directions are counted: below the horizon, no surface is asked for their value."""
    original = inspect.getattr_static(cls, "sample")

    @functools.wraps(original)
    def sample(self, x, n, xi):
        """A direction from the lights, counted."""
        found = original.__get__(self, type(self))(x, n, xi)
        tally.direction(n, found[0])
        return found

    return in_kernels(sample)
