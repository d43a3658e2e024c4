"""Progressive rendering: every call adds samples to every pixel, and any change starts over (A2-2)."""

import json
import warnings
from enum import Enum
from pathlib import Path
from time import perf_counter

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer import sampler
from taichi_tracer.camera import ProjectiveCamera, make_camera
from taichi_tracer.fast.primary_hits import PrimaryHits
from taichi_tracer.files.checkpoint import check_same, read_checkpoint, show_ranges, write_checkpoint
from taichi_tracer.integrators.direct_light import Lighting, SurfacePoint
from taichi_tracer.integrators import direct_light as direct_illumination
from taichi_tracer.integrators import surface_views
from taichi_tracer.picture.adaptive import adapt
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.film import Film
from taichi_tracer.picture.progress import Progress, Target
from taichi_tracer.ray import offset_origin
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of

SAMPLERS = {s.name: s for s in sampler.ALL}


@ti.data_oriented
class ProgressiveRenderer:
    """A camera, a film and a choice among the things that the subclass ``offers``.

    Args:
        scene_data: the scene.
        width, height: pixels.
        camera: None makes one that shows the scene.
        jitter: whether eye rays pass through a random point of their pixel (A2-1); None is what the subclass does.
        sampler: a name in ``SAMPLERS``.
        seed: of the random numbers; the same seed gives the same picture.
        first_sample: index of the first sample, so that disjoint ranges can be rendered apart and merged.
        crop: pixels that take samples, see ``Film``.
        adaptive: whether pixels take samples in proportion to their deviation, see ``adaptive``.
    """

    offers: tuple = ()  # what ``use`` can choose: objects with a name, a label and aliases
    what = "view"  # what one of them is called in messages
    setter = "set_shade_"  # how the methods that choose one begin
    srgb = False  # whether pictures are radiance, to be written with the sRGB transfer function (C-14)
    jitters = False
    needs_light = False

    def __init_subclass__(cls, **options) -> None:
        """Give the subclass a setter for everything it offers."""
        super().__init_subclass__(**options)
        for choice in cls.offers:
            for name in (choice.name, *choice.aliases):
                setattr(cls, cls.setter + name, _setter(choice))

    def __init__(
        self,
        scene_data: SceneData,
        width: int = 512,
        height: int = 512,
        camera: ProjectiveCamera | None = None,
        jitter: bool | None = None,
        sampler: str = "sobol",
        seed: int = 0,
        first_sample: int = 0,
        crop: tuple[int, int, int, int] | None = None,
        adaptive: bool = False,
    ) -> None:
        scene_data.check_alive()
        if sampler not in SAMPLERS:
            raise one_of("sampler", sampler, SAMPLERS)
        for name, number in (("seed", seed), ("first_sample", first_sample)):
            if int(number) != number or not 0 <= number < 2**32:
                raise InputError(f"renderer: {name} must be a whole number from 0 to 2^32 - 1, not {number!r}")
        self.scene_data = scene_data
        self.camera = make_camera(width, height, **scene_data.view) if camera is None else camera
        self.width, self.height = self.camera.width, self.camera.height
        self.jitter = self.jitters if jitter is None else bool(jitter)
        self.sampler, self.seed, self.first_sample = SAMPLERS[sampler], int(seed), int(first_sample)
        if adaptive and not self.jitter:
            raise InputError("renderer: adaptive sampling needs random samples: give jitter=True, or an estimator")
        self.adaptive, self.mean_share = bool(adaptive), 1.0
        replicated = self.sampler.replicated
        keeps_deviation, averages = self.adaptive or not replicated, self.jitter or self.jitters
        self.film = Film(self.width, self.height, crop, replicated, keeps_deviation, averages)
        self.hits = PrimaryHits(
            scene_data, self.camera, self.jitter, self.sampler, ranges=self.film.ranges, adaptive=self.adaptive
        )
        self.active = self.offers[0]
        self._shown = None  # what the samples on the film are of
        self._traced = None  # what ``hits`` belongs to
        self.progress = Progress(Target())

    @classmethod
    def names(cls) -> list[str]:
        """The names that ``use`` knows."""
        return [choice.name for choice in cls.offers]

    def use(self, name: str):
        """Choose what to render, by name; returns the renderer."""
        name = getattr(name, "value", name)
        for choice in self.offers:
            if name in (choice.name, *choice.aliases):
                self.active = choice
                return self
        raise one_of(self.what, name, self.names())

    @property
    def samples(self) -> int:
        """Samples per pixel on the film; of adaptive sampling, their mean."""
        return round(self.film.samples * self.mean_share)

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

    def reset(self) -> None:
        """Start over with the next ``render``."""
        self.film.reset()

    def begin_anew(self) -> None:
        """Start over with the next ``render``, with a new pilot where there is one: for another seed."""
        self.reset()
        self._shown = None

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
        if spp is None and time is None and error is None:
            spp = 1
        self.progress = progress = Progress(Target(spp, time, error))
        if not self.is_current():
            self.begin()
            if self.adaptive:
                progress.pilot = adapt(self)
                self.progress = progress
        looks = error is not None or watch is not None
        while not progress.is_done:
            start, forms = perf_counter(), self.hits.forms
            self.add_sample(self.first_sample + self.film.samples)
            if time is not None or looks:
                ti.sync()
            self.film.samples += 1
            compiles = progress.samples == 0 or self.hits.forms != forms
            progress.took(perf_counter() - start, self.mean_share, compiles)
            if looks and self.jitter:
                progress.look(self.error)
            if not self.jitter and (error is not None or time is not None):
                break
            if watch is not None:
                watch(progress)
        return self

    def begin(self) -> None:
        """Start over, with the picture that is asked for now."""
        self.reset()
        self._shown = self.state()

    def state(self) -> tuple:
        """Everything that the picture depends on; samples of one state do not belong with those of another."""
        scene = self.scene_data
        sky = 0 if scene.environment is None else scene.environment.version
        return self.active.name, self.camera.version, scene.version, sky

    def is_current(self) -> bool:
        """Whether the samples on the film are of what would be shown now."""
        return self._shown == self.state()

    def facts(self) -> dict:
        """What the bits of a picture depend on, for checkpoints: samples of different facts do not belong together."""
        settings, camera = runtime.current(), self.camera
        window = camera.compute_half_size(), camera.compute_centre()
        return {
            "scene": self.scene_data.fingerprint(),
            "camera": repr((camera.projection, camera.compute_matrix().tolist(), *window)),
            self.what: self.active.name,
            "size": [self.width, self.height],
            "crop": list(self.film.crop),
            "srgb": self.srgb,
            "sampler": self.sampler.name,
            "seed": self.seed,
            "jitter": self.jitter,
            "triangle test": self.scene_data.ray_intersector.triangle_test,
            "precision": settings.precision,
            "fast math": settings.fast_math,
        }

    def save_checkpoint(self, path: str | Path) -> None:
        """Write the samples so far, so that ``load_checkpoint`` can go on from there."""
        if self.adaptive:
            raise InputError("checkpoint: adaptive sampling cannot go on from a file")
        if not self.jitter:
            raise InputError(f"checkpoint: every sample of {self.active.name} is the picture itself: nothing to keep")
        ranges = [[self.first_sample, self.first_sample + self.samples]]
        write_checkpoint(path, {"samples": ranges, **self.facts()}, self.film.to_arrays())

    def load_checkpoint(self, path: str | Path) -> None:
        """Go on from a checkpoint: ``render`` then adds the samples that it would have added there.

        Raises:
            InputError: the file is damaged, or its samples are of something else; nothing has changed then.
        """
        facts, arrays = read_checkpoint(path)
        ranges = facts.pop("samples", None)
        check_same(path, facts, "this picture", json.loads(json.dumps(self.facts())))
        if len(ranges) != 1 or ranges[0][0] != self.first_sample:
            raise InputError(f"{path}: holds the samples {show_ranges(ranges)}, not those from {self.first_sample} on")
        self.begin()
        self.film.from_arrays(arrays, ranges[0][1] - ranges[0][0])

    def add_sample(self, index: int) -> None:
        """One sample for every pixel; a subclass says of what."""
        raise NotImplementedError(f"{type(self).__name__} must say what a sample is")

    def trace_primary_hits(self, index: int) -> None:
        """Bring ``hits`` up to date; without jitter they stay until the camera moves, whatever is made of them."""
        wanted = (self.camera.version, *((self.seed, index, self.adaptive) if self.jitter else ()))
        if self._traced != wanted:
            self.hits.trace(self.seed, index)
            self._traced = wanted

    @ti.func
    def record(self, x, y, value, index):
        """Bring the value of a pixel to the film: a sample, or without jitter what every sample would be."""
        if ti.static(self.jitter):
            i, is_taken = self.hits.sample_index(x, y, index)
            if is_taken:
                self.film.add(x, y, value, i)
        else:
            self.film.put(x, y, value)

    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first; rendered first if no sample of it was taken."""
        self.scene_data.check_alive()
        if self.samples == 0 or not self.is_current():
            self.render()
        return self.film.image()

    def _repr_png_(self) -> bytes:
        """The picture so far, for notebooks."""
        from taichi_tracer.files.images import encode_png

        return encode_png(self.image(), srgb=self.srgb)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.active.name}, {self.width}×{self.height}, {self.samples} samples)"


def _setter(choice):
    def set_choice(self):
        return self.use(choice.name)

    set_choice.__doc__ = f"Show {choice.label}; the same as use({choice.name!r})."
    return set_choice


@ti.data_oriented
class A1Renderer(ProgressiveRenderer):
    """Assignment 1: what did the primary ray hit? Six views of it (A1-15)."""

    offers = surface_views.ALL

    def add_sample(self, index: int) -> None:
        """Without jitter, every sample of a view is the picture itself."""
        self.trace_primary_hits(index)
        self._shade(self.active.color, index)

    @ti.kernel
    def _shade(self, color: ti.template(), index: ti.u32):
        for x, y in ti.ndrange(*self.film.ranges):
            ray = self.hits.eye_ray(x, y)
            data = self.hits.hit_data(x, y, ray)
            value = tm.vec3(0)
            if data.is_hit:
                value = color(data)
            self.record(x, y, value, index)


@ti.data_oriented
class A2Renderer(ProgressiveRenderer):
    """Assignment 2: direct illumination by the environment, by Monte Carlo (A2-3, A2-9)."""

    offers = direct_illumination.ALL
    what = "estimator"
    setter = "set_sample_"
    srgb = True
    jitters = True
    needs_light = True
    SampleMode = Enum("SampleMode", {choice.name.upper(): choice.name for choice in direct_illumination.ALL})
    SamplingMode = SampleMode

    def begin(self) -> None:
        """Start over; warns where there is no light to be rendered."""
        super().begin()
        if self.scene_data.effects.is_dark:
            advice = "give it an environment, such as 'studio', or a material with Ke > 0"
            warnings.warn(f"nothing in this scene emits light: {advice}", stacklevel=3)

    def add_sample(self, index: int) -> None:
        """One estimate per pixel, of its own eye ray."""
        if self.lit != self.scene_data.version:
            self.lighting, self.lit = Lighting(self.scene_data, self.sampler), self.scene_data.version
        self.trace_primary_hits(index)
        self._shade(self.lighting, self.active, self.seed, index)

    lit = None  # the version of the scene that ``lighting`` belongs to

    @ti.kernel
    def _shade(self, lighting: ti.template(), estimator: ti.template(), seed: ti.u32, index: ti.u32):
        for x, y in ti.ndrange(*self.film.ranges):
            i, is_taken = self.hits.sample_index(x, y, index)
            if is_taken:
                key = self.hits.key(x, y, seed, i)
                ray = self.hits.eye_ray(x, y)
                data = self.hits.hit_data(x, y, ray)
                L = self.shade_ray(lighting, estimator, ray, data, key)
                if ti.static(lighting.effects.background):
                    if not data.is_hit:
                        L = lighting.behind(ray.direction, x, y, self.width, self.height)
                self.film.add(x, y, L, i)

    @ti.func
    def shade_ray(self, lighting: ti.template(), estimator: ti.template(), ray, data, key):
        """Radiance arriving along the ray: one sample (A2-9)."""
        L = tm.vec3(0)
        if data.is_hit:
            material = self.scene_data.material_library.get(data.material_id)
            if ti.static(lighting.effects.emitters):
                L = material.Ke
            if ti.static(lighting.effects.is_lit):
                position, error = self.scene_data.geometry.hit_position(data)
                point = SurfacePoint(
                    origin=offset_origin(position, error, data.geometric_normal),
                    normal=data.normal,
                    geometric_normal=data.geometric_normal,
                    w_o=-ray.direction,
                )
                kind = self.scene_data.material_library.kinds[data.material_id]
                L += direct_illumination.reflected(lighting, estimator, material, kind, point, key)
        else:
            L = lighting.radiance(ray.direction)
        return L
