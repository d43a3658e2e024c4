"""Progressive rendering: every call adds samples to every pixel, and any change starts over (A2-2).

The heart is ``ProgressiveRenderer._take_sample``: pixel → ray → radiance → film. The assignments' renderers say which
integrators they offer, and have the handouts' methods.
"""

import copy
import warnings
from enum import Enum
from pathlib import Path

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.camera import ProjectiveCamera, change_projection, make_camera, through_pixel
from taichi_tracer.fast.primary_hits import PrimaryHits, kept_hits_form
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.direct_light import UniformSphere
from taichi_tracer.picture import checkpoint
from taichi_tracer.picture.adaptive import Shares
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.film import Film
from taichi_tracer.picture.progress import Progress, Target, render_until
from taichi_tracer.ray import no_hit
from taichi_tracer.sampler import RandomNumbers, Sampler, UniformSampler, sampler_of
from taichi_tracer.scene_data import SceneData, SceneInKernels
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS, register
from taichi_tracer.system.seams import called, in_kernels, replaced, seams, why_replaced

# What a pixel takes at most: numbers of the running precision on the film and among the kept hits, and other bytes.
NUMBERS_PER_PIXEL, BYTES_PER_PIXEL = 23, 52


@ti.data_oriented
class EyeRays:
    """The plain form of what every pixel's ray meets: ``generate_ray``, then ``query_ray``.

    Args:
        traces: False where somebody's ``shade_ray`` asks what the ray meets: then it is not asked here.
    """

    def __init__(self, scene_data: SceneData, camera: ProjectiveCamera, jitter: bool, traces: bool = True) -> None:
        self.camera, self.intersector = camera, scene_data.ray_intersector
        self.jitter, self.traces = jitter, traces
        self.forms, self.can_use_packets, self.use_packets = frozenset({"plain"}), False, False

    def bring_up_to_date(self, seed: int, index: int) -> None:
        """Nothing is kept, so nothing is out of date."""

    @ti.func
    def hit_of(self, x, y, rng):
        """(ray, HitData) of a pixel; the first pair of random numbers is the point within it (A2-1)."""
        ray = through_pixel(self.camera.generate_ray, x, y, self.jitter, rng.next_2d())
        hit = no_hit()
        if ti.static(self.traces):
            hit = self.intersector.query_segment(ray, 0.0, tm.inf)
        return ray, hit


def camera_of(chosen, width: int, height: int, view: dict) -> ProjectiveCamera:
    """The camera that a slot was given, or one of the chosen kind that shows a view."""
    if chosen is None:
        return make_camera(width, height, **view)
    found = PARTS.find("camera", chosen)
    if isinstance(found, type):
        return make_camera(width, height, **change_projection(view, found))
    return found


@ti.data_oriented
@seams("shade_ray")
class ProgressiveRenderer:
    """A camera, a film, and an integrator among those that the subclass offers.

    Args:
        scene_data: the scene.
        width, height: pixels.
        camera: an object, whose size counts; or the name or the class of one that is to show the scene; None is the
            camera of the scene.
        jitter: whether eye rays pass through a random point of their pixel (A2-1); None is what the subclass does.
        sampler: the name of a registered sampler, or a ``Sampler``; a ``UniformSampler`` is what the estimator
            ``uniform`` takes its directions from.
        seed: of the random numbers; the same seed gives the same picture.
        first_sample: index of the first sample, so that disjoint ranges can be rendered apart and merged.
        crop: pixels that take samples, see ``Film``.
        adaptive: whether pixels take samples in proportion to their deviation, see ``picture.adaptive``.
        integrator: what to render, by name or as an object; None is the first that the subclass offers.
        fast: False runs only the plain forms; None does as the scene does.
    """

    kind, name = "renderer", ""
    what = "view"  # which integrators it offers, and what one of them is called in messages
    jitters = False  # whether its pictures are random without being asked to

    def __init__(
        self,
        scene_data: SceneData,
        width: int = 512,
        height: int = 512,
        camera: ProjectiveCamera | type | str | None = None,
        jitter: bool | None = None,
        sampler="sobol",
        seed: int = 0,
        first_sample: int = 0,
        crop: tuple[int, int, int, int] | None = None,
        adaptive: bool = False,
        integrator=None,
        fast: bool | None = None,
    ) -> None:
        if not isinstance(scene_data, SceneData):
            raise InputError(f"renderer: scene_data is a scene, as load_scene_data returns it, not {scene_data!r}")
        scene_data.check_alive()
        for name, number in (("seed", seed), ("first_sample", first_sample)):
            if int(number) != number or not 0 <= number < 2**32:
                raise InputError(f"renderer: {name} must be a whole number from 0 to 2^32 - 1, not {number!r}")
        self.scene_data = scene_data
        self.camera = camera_of(camera, width, height, scene_data.view)
        self.width, self.height = self.camera.width, self.camera.height
        bytes_per_pixel = NUMBERS_PER_PIXEL * np.dtype(runtime.dtype()).itemsize + BYTES_PER_PIXEL
        memory.ask_for(self.width * self.height * bytes_per_pixel, f"a picture of {self.width}x{self.height} pixels")
        self.jitter = self.jitters if jitter is None else bool(jitter)
        self.is_random = self.jitter or self.jitters
        chosen = PARTS.find("sampler", sampler)
        directions = chosen if isinstance(chosen, UniformSampler) else None
        self.sampler: Sampler = sampler_of(
            chosen if directions is None else PARTS.find("sampler", "sobol"), self.camera
        )
        self.seed, self.first_sample = int(seed), int(first_sample)
        if adaptive and not self.is_random:
            raise InputError("renderer: adaptive sampling needs random samples: give jitter=True, or an estimator")
        self.adaptive, self.shares = bool(adaptive), Shares(self.width, self.height, bool(adaptive))
        keeps_deviation = self.adaptive or not self.sampler.replicated
        self.film = Film(self.width, self.height, crop, self.sampler.replicated, keeps_deviation, self.is_random)
        self.fast = scene_data.fast if fast is None else bool(fast)
        self.replaced = replaced(self)
        self.eye_rays, self._form = self._make_eye_rays()
        self._integrators: dict[str, Integrator] = {}
        if directions is not None:
            self._integrators["uniform"] = UniformSphere(directions)
        self._shown = None  # what the samples on the film are of
        self.progress = Progress(Target())
        self.use(self.offers[0] if integrator is None else integrator)

    def _make_eye_rays(self):
        """What gives the kernel its rays and hits, and which form that is."""
        form = kept_hits_form(self.scene_data, self.camera, self.sampler, self.fast)
        if "shade_ray" in self.replaced:
            form = type(form)("eye rays", "one by one, as they are written", why_replaced(self))
            return EyeRays(self.scene_data, self.camera, self.jitter, traces=False), form
        if not form.is_fast:
            return EyeRays(self.scene_data, self.camera, self.jitter), form
        hits = PrimaryHits(
            self.scene_data, self.camera, self.jitter, self.sampler, shares=self.shares, ranges=self.film.ranges
        )
        return hits, form

    # ── what is rendered ──

    @classmethod
    def offered(cls) -> tuple[Integrator, ...]:
        """The registered integrators that this renderer can use."""
        return tuple(part for part in PARTS.all("integrator") if part.what == cls.what)

    @property
    def offers(self) -> tuple[Integrator, ...]:
        """``offered``, and those that were given to this renderer as objects."""
        known = {part.name: part for part in self.offered()}
        return tuple({**known, **self._integrators}.values())

    @classmethod
    def names(cls) -> list[str]:
        """The names that ``use`` knows."""
        return [part.name for part in cls.offered()]

    def use(self, integrator):
        """Choose what to render, by name or by giving the integrator itself; returns the renderer."""
        chosen = getattr(integrator, "value", integrator)  # of a SampleMode
        if isinstance(chosen, str):
            known = {name: part for part in self.offers for name in (part.name, *part.aliases)}
            if chosen not in known:
                raise one_of(self.what, chosen, [part.name for part in self.offers])
            chosen = known[chosen]
        else:
            chosen = PARTS.find("integrator", chosen)
            self._integrators[chosen.name] = chosen
        # A copy of its own, since what an integrator keeps, such as a range of depths, belongs to one picture.
        self.active = self._integrators.setdefault(chosen.name, copy.copy(chosen))
        return self

    @property
    def needs_light(self) -> bool:
        """Whether what is rendered is light, which the scene has to have."""
        return self.active.needs_light

    @property
    def srgb(self) -> bool:
        """Whether the picture is radiance or colour, to be written with the sRGB transfer function (C-14)."""
        return self.active.srgb

    # ── the heart ──

    @ti.kernel
    def _take_sample(
        self, scene: ti.template(), integrator: ti.template(), eye_rays: ti.template(), seed: ti.u32, index: ti.u32
    ):
        for x, y in ti.ndrange(*self.film.ranges):
            i, is_taken = self.shares.sample_of(x, y, index)
            if is_taken:
                rng = self.sampler.start(seed, x, y, i)
                ray, hit = eye_rays.hit_of(x, y, rng)
                self.record(x, y, self.radiance(scene, integrator, ray, hit, rng), i)

    @ti.func
    def record(self, x, y, value, index):
        """Bring the value of a pixel to the film: a sample, or what every sample would be."""
        if ti.static(self.is_random):
            self.film.add(x, y, value, index)
        else:
            self.film.put(x, y, value)

    @in_kernels
    def radiance(self, scene, integrator, ray, hit, rng):
        """One sample of what arrives along the ray: the integrator's, or that of a replaced ``shade_ray``."""
        if "shade_ray" in self.replaced:
            return called(self.shade_ray, ray)
        return integrator.radiance(scene, ray, hit, rng)

    @ti.func
    def shade_ray(self, ray):
        """What a ray shows, by the integrator in use: the handout's form, which traces the ray itself (A2-9)."""
        hit = self.scene_data.ray_intersector.query_segment(ray, 0.0, tm.inf)
        return self._shade_hit(ray, hit)

    @in_kernels
    def _shade_hit(self, ray, hit):
        rng = RandomNumbers.of_this_kernel()
        return self.active.radiance(self.scene_data.in_kernels(), ray, hit, rng)

    def kernel_scene(self) -> SceneInKernels:
        """What the kernels know of the scene."""
        return self.scene_data.in_kernels()

    def add_sample(self, index: int) -> None:
        """One sample for every pixel."""
        scene = self.kernel_scene()
        if self.active.samples_lights:
            scene.lights.prepare()
        self.eye_rays.bring_up_to_date(self.seed, index)
        self._take_sample(scene, self.active, self.eye_rays, self.seed, index)

    def render(self, spp: int | None = None, time: float | None = None, error: float | None = None, watch=None):
        """Add samples to every pixel until the first of the targets is reached; returns the renderer.

        Args:
            spp: samples per pixel to add; 1 when no target is given.
            time: seconds of rendering. Compilation does not count: ``progress`` tells both.
            error: relative RMSE as estimated (``error()``), a fraction: 0.02 is 2 %. Only what takes random samples
                has one; where every sample is the picture itself, it and the time are reached at once.
            watch: called with ``progress`` after every sample of every pixel.
        """
        self.scene_data.check_alive()
        render_until(self, Target(1 if spp is None and time is None and error is None else spp, time, error), watch)
        return self

    # ── whether the samples are of what would be shown now ──

    def state(self) -> tuple:
        """Everything that the picture depends on; samples of one state do not belong with those of another."""
        scene = self.scene_data
        sky = 0 if scene.environment is None else scene.environment.version
        return id(self.active), self.camera.version, scene.version, sky, *(light.version for light in scene.lights)

    def is_current(self) -> bool:
        """Whether the samples on the film are of what would be shown now."""
        return self._shown == self.state()

    def reset(self) -> None:
        """Start over with the next ``render``."""
        self.film.reset()

    def begin(self) -> None:
        """Start over, with the picture that is asked for now."""
        self.reset()
        if hasattr(self.active, "prepare"):
            self.active.prepare(self.scene_data, self.camera)
        self._shown = self.state()

    def begin_anew(self) -> None:
        """Start over with the next ``render``, with a new pilot where there is one: for another seed."""
        self.reset()
        self._shown = None

    # ── the picture, and what is known of it ──

    @property
    def samples(self) -> int:
        """Samples per pixel on the film; of adaptive sampling, their mean."""
        return round(self.film.samples * self.shares.mean)

    @property
    def canvas(self):
        """The Taichi field [x, y] of RGB vectors, y up: what ``ti.ui`` shows."""
        self.film.check_alive()
        return self.film.canvas

    @property
    def non_finite(self) -> int:
        """How many samples were not finite, and so not added; ``film.non_finite_samples`` says where."""
        return self.film.non_finite

    def error(self) -> RelativeError:
        """Relative RMSE of the picture as its own samples tell, with its 95 % interval: see ``error_estimate``."""
        return self.film.error()

    def error_image(self) -> np.ndarray:
        """(height, width, 3) float32, top row first: the standard error of every pixel; NaN where it is not known.

        With the low-discrepancy sampler, one pixel's is told by a single difference: look at regions.
        """
        return np.sqrt(self.film.variance_of_mean())

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first; rendered first if no sample of it was taken."""
        self.scene_data.check_alive()
        if self.samples == 0 or not self.is_current():
            self.render()
        return self.film.image()

    def receipt(self) -> list[str]:
        """A line for each effect and each form: what is simulated, what runs, and why."""
        lines = [*self.scene_data.receipt(), str(self._form)]
        if self.replaced:
            lines.append(f"{'shading':<15} as it is written: {why_replaced(self)}")
        return lines

    def facts(self) -> dict:
        """What the bits of a picture depend on, for checkpoints: see ``picture.checkpoint``."""
        return checkpoint.facts_of(self)

    def save_checkpoint(self, path: str | Path) -> None:
        """Write the samples so far, so that ``load_checkpoint`` can go on from there."""
        checkpoint.save(self, path)

    def load_checkpoint(self, path: str | Path) -> None:
        """Go on from a checkpoint: ``render`` then adds the samples that it would have added there.

        Raises:
            InputError: the file is damaged, or its samples are of something else; nothing has changed then.
        """
        checkpoint.load(self, path)

    def _repr_png_(self) -> bytes:
        """The picture so far, for notebooks."""
        from taichi_tracer.files.images import encode_png

        return encode_png(self.image(), srgb=self.srgb)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.active.name}, {self.width}×{self.height}, {self.samples} samples)"


@register
@ti.data_oriented
@seams("shade_hit", "shade_triangle_id", "shade_distance", "shade_barycentric", "shade_normal", "shade_material_id")
class A1Renderer(ProgressiveRenderer):
    """Assignment 1: what did the primary ray hit? Six views of it (A1-15)."""

    name, what = "A1Renderer", "view"

    @in_kernels
    def radiance(self, scene, integrator, ray, hit, rng):
        """A replaced ``shade_ray``, a replaced method of the view in use, or the view itself."""
        own = f"shade_{integrator.name}"
        if "shade_ray" not in self.replaced and own in self.replaced:
            return called(getattr(self, own), hit)
        return ProgressiveRenderer.radiance(self, scene, integrator, ray, hit, rng)

    @in_kernels
    def _view(self, name: str, hit_data):
        view = PARTS.find("integrator", name)
        return view.radiance(self.scene_data.in_kernels(), None, hit_data, None)

    @ti.func
    def shade_hit(self, hit_data):
        """White in front, dark red behind, black where nothing is hit."""
        return self._view("hit", hit_data)

    @ti.func
    def shade_triangle_id(self, hit_data):
        """A colour per triangle."""
        return self._view("triangle_id", hit_data)

    @ti.func
    def shade_distance(self, hit_data):
        """Black at the eye, white at 10 units and beyond."""
        return self._view("distance", hit_data)

    @ti.func
    def shade_barycentric(self, hit_data):
        """(u, v, w) as red, green, blue."""
        return self._view("barycentric", hit_data)

    @ti.func
    def shade_normal(self, hit_data):
        """[−1, 1] mapped to [0, 1], per axis."""
        return self._view("normal", hit_data)

    @ti.func
    def shade_material_id(self, hit_data):
        """A colour per material."""
        return self._view("material_id", hit_data)

    def set_shade_hit(self):
        """Show hits: the same as use("hit")."""
        return self.use("hit")

    def set_shade_triangle_id(self):
        """Show triangle ids."""
        return self.use("triangle_id")

    def set_shade_triangle_ID(self):  # noqa: N802 (the handout's spelling)
        """Show triangle ids."""
        return self.use("triangle_id")

    def set_shade_distance(self):
        """Show distances."""
        return self.use("distance")

    def set_shade_barycentric(self):
        """Show barycentric coordinates."""
        return self.use("barycentric")

    def set_shade_barycentrics(self):
        """Show barycentric coordinates."""
        return self.use("barycentric")

    def set_shade_normal(self):
        """Show normals."""
        return self.use("normal")

    def set_shade_normals(self):
        """Show normals."""
        return self.use("normal")

    def set_shade_material_id(self):
        """Show material ids."""
        return self.use("material_id")

    def set_shade_material_ID(self):  # noqa: N802 (the handout's spelling)
        """Show material ids."""
        return self.use("material_id")


@register
@ti.data_oriented
@seams()
class A2Renderer(ProgressiveRenderer):
    """Assignment 2: direct illumination by the environment, by Monte Carlo (A2-3, A2-9)."""

    name, what, jitters = "A2Renderer", "estimator", True
    SampleMode = Enum(
        "SampleMode", {n.upper(): n for n in ("uniform", "hemisphere", "brdf", "environment", "mis", "mis_balance")}
    )
    SamplingMode = SampleMode

    def begin(self) -> None:
        """Start over; warns where there is no light to be rendered."""
        super().begin()
        if self.scene_data.effects.is_dark:
            advice = "give it an environment, such as 'studio', or a material with Ke > 0"
            warnings.warn(f"nothing in this scene emits light: {advice}", stacklevel=4)

    def set_sample_uniform(self):
        """Sample directions uniform on the sphere."""
        return self.use("uniform")

    def set_sample_uniform_sphere(self):
        """Sample directions uniform on the sphere."""
        return self.use("uniform")

    def set_sample_hemisphere(self):
        """Sample directions uniform on the hemisphere about the normal."""
        return self.use("hemisphere")

    def set_sample_uniform_hemisphere(self):
        """Sample directions uniform on the hemisphere about the normal."""
        return self.use("hemisphere")

    def set_sample_brdf(self):
        """Sample directions in proportion to the BRDF."""
        return self.use("brdf")

    def set_sample_environment(self):
        """Sample directions in proportion to the environment's light."""
        return self.use("environment")

    def set_sample_light(self):
        """Sample directions in proportion to the environment's light."""
        return self.use("environment")

    def set_sample_mis(self):
        """Multiple importance sampling by the power heuristic."""
        return self.use("mis")

    def set_sample_mis_power(self):
        """Multiple importance sampling by the power heuristic."""
        return self.use("mis")

    def set_sample_mis_balance(self):
        """Multiple importance sampling by the balance heuristic."""
        return self.use("mis_balance")
