"""Which form of a part runs: the plain form, which a student reads, or a fast form with the same bits.

This is the only door to the folder ``fast``. Everything here is the answer of a package without fast forms. If the
folder exists, ``fast/plan.py`` may give another answer; it says why.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import taichi as ti
import taichi.math as tm

from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.camera_calls import through_pixel
from taichi_tracer.ray import no_hit
from taichi_tracer.system.seams import why_replaced
from taichi_tracer.system.stopwatch import LIGHTS, SAMPLES, stage
from taichi_tracer.system.wings import is_there, wing

NO_FAST_FORMS = "this installation has no fast forms"


@dataclass(frozen=True)
class Form:
    """Which form of a part runs, for receipts.

    Attributes:
        what: "rays", "eye rays" or "samples".
        runs: the form. why: the reason. is_fast: whether it stands in for a plain form.
    """

    what: str
    runs: str
    why: str
    is_fast: bool = False

    def __str__(self) -> str:
        return f"{self.what:<15} {self.runs}: {self.why}"


@ti.data_oriented
class EyeRays:
    """The ray of every pixel and its hit, in the plain form: ``generate_ray``, then ``query_ray``.

    Args:
        scene_data: the ``SceneData``. camera: makes the rays. jitter: whether a ray passes through a random point.
        traces: whether the ray is traced here. It is False if a replaced ``shade_ray`` traces the ray itself.
    """

    def __init__(self, scene_data: Any, camera: ProjectiveCamera, jitter: bool, traces: bool = True) -> None:
        self.camera, self.intersector = camera, scene_data.ray_intersector
        self.jitter, self.traces = jitter, traces

    @ti.func
    def hit_of(self, x, y, rng):
        """(ray, HitData) of a pixel; the first pair of random numbers is the point within the pixel (A2-1)."""
        ray = through_pixel(self.camera.generate_ray, x, y, self.jitter, rng.next_2d())
        hit = no_hit()
        if ti.static(self.traces):
            hit = self.intersector.query_segment(ray, 0.0, tm.inf)
        return ray, hit


class SampleParts(NamedTuple):
    """What a sample is made of. Who watches samples puts observed copies in the places of some: ``system.observed``."""

    scene: Any  # a ``SceneInKernels``
    integrator: Any
    eye_rays: Any
    sampler: Any
    shares: Any
    film: Any  # a ``Film``, or what takes samples in its place


class Plan:
    """How a renderer takes its samples: here, every part in its plain form.

    Args:
        renderer: the ``ProgressiveRenderer``.
        why: the reason for receipts.

    Attributes:
        eye_rays: the object that gives the kernel its rays and hits.
        in_tiles: whether samples are taken tile by tile.
        keeps_tiles: whether they were so far, in a plan to which this one is the next for the same picture.
    """

    in_tiles = keeps_tiles = False

    def __init__(self, renderer: Any, why: str = NO_FAST_FORMS) -> None:
        self.renderer: Any = renderer
        is_replaced = "shade_ray" in renderer.replaced
        self.eye_rays: Any = EyeRays(renderer.scene_data, renderer.camera, renderer.jitter, not is_replaced)
        self.form = plain_rays(why_replaced(renderer) if is_replaced else why)

    def integrator(self, scene: Any) -> Any:
        """What kernels get as the integrator in use, in a scene (a ``SceneInKernels``)."""
        return self.renderer.active

    @property
    def compiled(self) -> frozenset:
        """The forms of the kernels that were used so far: a new one means that a kernel was compiled."""
        return frozenset({"plain"})

    def expect(self, target: Any, is_continued: bool, passes: float | None = None) -> None:
        """Choose the forms, now that it is known how long the picture will take, as far as nothing is compiled yet.

        Args:
            target: the ``Target`` of ``render``. is_continued: whether the samples are added to those on the film.
            passes: how many passes over all pixels will come, if somebody knows better than ``target``.
        """

    def will_take_tiles(self, integrator: Any, target: Any) -> bool | None:
        """Whether an integrator's samples will be taken tile by tile from the first one on; None if nobody knows."""
        return None

    def ended(self) -> None:
        """A call of ``render`` has ended: the plan may note how long it took."""

    def prepared_scene(self) -> Any:
        """The part of the scene that kernels use, whose lights have their tables."""
        with stage(LIGHTS):
            scene = self.renderer.kernel_scene()
            scene.lights.prepare(self.renderer.active.samples_lights)
        return scene

    @property
    def passes_at_once(self) -> int:
        """How many passes one launch of a kernel takes: several, if few pixels take a sample in each of them."""
        return max(1, int(1 / self.renderer.shares.mean))

    def take(self, index: int, count: int = 1) -> None:
        """Take so many samples for every pixel."""
        scene = self.prepared_scene()
        with stage(SAMPLES, waits=True):
            self.take_each(scene, index, count)

    def take_each(self, scene: Any, index: int, count: int = 1) -> None:
        """Take so many samples for every pixel, pixel by pixel."""
        r = self.renderer
        r._take_samples(r.sample_parts(scene, self.integrator(scene)), r.seed, index, count)

    def follow(self, other: "Plan") -> None:
        """Take over the choices of another renderer's plan, and its eye rays if they are the same."""

    def begin_soon(self) -> None:
        """Leave out the forms that take long to compile, because somebody waits for the first picture."""

    def may_become_faster(self) -> bool:
        """Whether a form was left out by ``begin_soon``; from now on the plan may choose it."""
        return False

    def trace_eye_rays(self, index: int) -> None:
        """Trace the eye rays of a sample before it is taken, if they are kept."""

    def keep_forms(self) -> None:
        """Choose the forms for good, so that none is compiled in the middle of a measurement."""

    def eye_passes(self, passes: int) -> int:
        """How often the eye rays of every pixel were traced, if so many samples were taken of it."""
        return passes

    def receipt(self) -> list[str]:
        """One line per form: which one runs, and why."""
        return [str(self.form)]


@cache
def fast_plan() -> Any:
    """The module ``fast.plan``; None if the folder ``fast`` was taken off."""
    return wing("fast.plan") if is_there("fast") else None


def plan_of(renderer: Any) -> Plan:
    """The plan of a renderer."""
    fast = fast_plan()
    return Plan(renderer) if fast is None else fast.plan_of(renderer)


def intersector_of(chosen: type, fast: bool) -> tuple[type, Form]:
    """The class that runs in place of an intersector's class (it may be the same), and its ``Form``.

    Args:
        fast: whether a fast form may stand in.
    """
    plan = fast_plan()
    if plan is None:
        return chosen, Form("rays", f"{chosen.__name__}, the plain form", NO_FAST_FORMS)
    return plan.intersector_of(chosen, fast)


def has_fast_form(chosen: type) -> bool:
    """Whether another class may run in place of an intersector's class."""
    return intersector_of(chosen, True)[1].is_fast


def plain_rays(why: str) -> Form:
    """Eye rays in the plain form."""
    return Form("eye rays", "one by one, as they are written", why)
