"""Progressive rendering: every call adds samples to every pixel, and any change starts the picture again (A2-2).

The central kernel is ``ProgressiveRenderer._take_samples``: pixel → ray → radiance → film. The renderers of the
assignments define which integrators they offer, and have the methods of the handouts.
"""

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import taichi as ti

from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.formulas.random_numbers import RandomNumbers
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.scene_in_kernels import SceneInKernels
from taichi_tracer.picture.progress import Progress, Target, render_until
from taichi_tracer.picture.sample_parts import SampleParts
from taichi_tracer.renderer_parts import RendererParts
from taichi_tracer.scene_data import SceneData
from taichi_tracer.settings import USUAL_LIGHT
from taichi_tracer.system import compiling
from taichi_tracer.system.compile_time import compile_time, one_at_a_time, variable
from taichi_tracer.system.course_fields import held
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.own_code.checks import values_of
from taichi_tracer.system.parts import adapt_signature, call_with_known_args, overridable
from taichi_tracer.system.stopwatch import KERNELS_MADE, LIGHTS, SAMPLES, stage

if TYPE_CHECKING:
    from typing_extensions import Self


def light_if_dark(scene_data: SceneData) -> None:
    """Light a scene in which nothing emits light, if nobody has said that it is dark; warn the caller of ``render``."""
    if not scene_data.effects.is_lit:
        advice = "give it an environment, such as 'studio', or a material with Ke > 0"
        if scene_data.is_light_open:
            scene_data.set_environment(USUAL_LIGHT)
            advice = f"the environment {USUAL_LIGHT!r} lights it; environment=None leaves it dark"
        warnings.warn(f"nothing in this scene emits light: {advice}", stacklevel=7)


@ti.data_oriented
@overridable("record", shade_ray="vec3")
class ProgressiveRenderer(RendererParts):
    """A camera, a film, and one of the integrators that the subclass offers.

    Args:
        scene_data: the scene. width, height: size of the picture in pixels. options: ``options.RendererOptions``.
    """

    # ── the central kernel ──

    @ti.kernel
    def _take_samples(self, of: ti.template(), seed: ti.u32, first: ti.u32, count: ti.i32):
        for x, y in ti.ndrange(*of.film.ranges):
            for k in range(count):
                i, is_taken = of.shares.sample_of(x, y, first + ti.cast(k, ti.u32))
                if is_taken:
                    rng = of.sampler.start(seed, x, y, i)
                    ray, hit = of.eye_rays.hit_of(x, y, rng)
                    self.keep(of.film, x, y, self.radiance(of.scene, of.integrator, ray, hit, rng), i)

    @compile_time
    def keep(self, film, x, y, value, index):
        """Give the value of a pixel to the film: by ``record``, unless somebody watches and takes it instead."""
        if film is self.film:
            self.record(x, y, value, index)
        else:
            film.record(x, y, value, index)

    @ti.func
    def record(self, x, y, value, index):
        """Take the value of a pixel: as one sample, or as the final value if samples are not random."""
        self.film.record(x, y, value, index)

    def sample_parts(self, scene: SceneInKernels, integrator: Integrator) -> SampleParts:
        """What a sample of this picture is made of, for ``_take_samples``."""
        return SampleParts(scene, integrator, self.eye_rays, self.sampler, self.shares, self.film)

    @compile_time
    def radiance(self, scene, integrator, ray, hit, rng):
        """One sample of the radiance along the ray, from the integrator or from a replaced ``shade_ray``."""
        if "shade_ray" in self.replaced:
            self._of_sample = scene, rng
            try:
                return call_with_known_args(self.shade_ray, ray)
            finally:
                self._of_sample = None
        return integrator.radiance(scene, ray, hit, rng)

    @compile_time
    def shade_ray(self, ray):
        """One sample of the integrator in use, in the handout's form: this method traces the ray itself (A2-9)."""
        hit = variable(self.scene_data.ray_intersector.query_segment(ray, 0.0, tm.inf))
        in_a_kernel_of_your_own = self.kernel_scene(), RandomNumbers.of_this_kernel()
        scene, rng = self._of_sample or in_a_kernel_of_your_own
        return self.active.radiance(scene, ray, hit, rng)

    @property
    def iter_counter(self) -> Any:
        """How many samples each pixel has; as in the course, ``iter_counter[None] = 0`` starts the picture again."""
        return held(self.samples, self._count_from)

    def _count_from(self, samples: int) -> None:
        if samples != 0:
            raise InputError(f"renderer: iter_counter[None] can only be set to 0, not to {samples!r}: call render")
        self.reset()

    def add_sample(self, index: int, count: int = 1) -> None:
        """Take the samples ``index``, ``index`` + 1, … of every pixel, ``count`` in all; fewer where it has a share."""
        with stage(LIGHTS):
            scene = self.kernel_scene()
            scene.lights.prepare(self.active.samples_lights)
        parts = self.sample_parts(scene, self.active)
        if parts != self._ready:
            self._ready = parts
            with stage(KERNELS_MADE), compiling.first_launch():
                self._take_samples(parts, self.seed, 0, 0)
        with stage(SAMPLES, waits=True):
            self._take_samples(parts, self.shares.seed_of(self.seed), index, count)

    @property
    def passes_at_once(self) -> int:
        """How many passes one launch of the kernel takes: several, if few pixels take a sample in each of them."""
        return max(1, int(1 / self.shares.mean))

    @one_at_a_time
    def add_range(self, first: int, end: int) -> None:
        """Take the samples ``first`` ≤ index < ``end`` of every pixel, several at once where few pixels take one."""
        while first < end:
            count = min(self.passes_at_once, end - first)
            self.add_sample(first, count)
            first += count

    @one_at_a_time
    def render(
        self,
        spp: int | None = None,
        time: float | None = None,
        error: float | None = None,
        watch: Callable[[Progress], object] | None = None,
    ) -> "Self":
        """Add samples to every pixel until the first of the targets is reached. Returns the renderer.

        Args:
            spp: samples per pixel to add; 1 if no target is given.
            time: seconds of rendering. Compilation does not count; ``progress`` has the times of both.
            error: the relative RMSE as a fraction: 0.02 is 2 %. It is reached when the upper end of the interval of
                ``error()`` is not larger. If every sample is the picture itself, as in a view without jitter, one
                sample reaches this target and the time.
            watch: a function that is called with ``progress`` after each pass over all pixels.
        """
        self.scene_data.check_alive()
        is_continued = self.samples > 0 and self.is_current()
        target = Target.of(spp, time, error)
        self.seconds_before = self.rendered_seconds if is_continued else 0.0
        render_until(self, target, watch)
        return self

    # ── whether the samples belong to the present state ──

    def state(self) -> tuple:
        """Everything that the picture depends on. Samples of different states must not be added up."""
        scene = self.scene_data
        sky = 0 if scene.environment is None else scene.environment.version
        values = sum(integrator.version for integrator in self._integrators.values())
        lights = tuple(light.version for light in scene.lights)
        own = values_of((self, self.active, self.camera, self.sampler, *scene.parts))
        return own, self.active, values, self.seed, self.camera.version, scene.version, sky, *lights

    def is_current(self) -> bool:
        """Whether the samples on the film belong to the present ``state``."""
        return self._shown == self.state()

    def reset(self) -> None:
        """Forget the samples, so that the next ``render`` starts the picture again."""
        self.shares.reset()
        self.film.reset()
        of = self.state()[2:]  # everything that the picture depends on beside the integrator
        if of != self._curves_of:
            self.error_curves, self._curves_of = {}, of
        self.error_curves.pop(self.active.name, None)

    @one_at_a_time
    def begin(self) -> None:
        """Start the picture again, in the present ``state``; warn if it is of light and nothing emits light."""
        if self.needs_light:
            light_if_dark(self.scene_data)
        own, *_ = self.state()
        if self._compiled_for is not None and own != self._compiled_for:
            self.eye_rays = self.make_eye_rays()
        self._compiled_for = own
        self.reset()
        adapt_signature(type(self.active))
        self.active.prepare(self.scene_data, self.camera)
        if self.replaced:  # such methods may read the values of any integrator
            for integrator in self.offered():
                self._own(integrator).prepare(self.scene_data, self.camera)
        self._shown = self.state()

    def begin_anew(self) -> None:
        """Let the next ``render`` start again after a change of the seed; adaptive sampling takes a new pilot."""
        self.reset()
        self._shown = None
