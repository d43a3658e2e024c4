"""Progressive rendering: every call adds samples to every pixel, and any change starts the picture again (A2-2).

The central kernel is ``ProgressiveRenderer._take_sample``: pixel → ray → radiance → film. The renderers of the
assignments define which integrators they offer, and have the methods of the handouts.
"""

import copy
import functools
import math
import warnings
from collections.abc import Callable, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.camera import ProjectiveCamera, change_projection, make_camera, through_pixel
from taichi_tracer.fast.primary_hits import PrimaryHits, kept_hits_form, pixels_in, plain_rays, why_not_kept
from taichi_tracer.fast.stand_ins import Form
from taichi_tracer.fast.tiles import TILES, Tiles, can_take_tiles, is_worth_tiles
from taichi_tracer.fast.view_tiles import ViewTiles, can_show
from taichi_tracer.files.images import check_writable, save_image
from taichi_tracer.files.picture import Picture
from taichi_tracer.integrators.base import Integrator
from taichi_tracer.integrators.controls import Control
from taichi_tracer.integrators.direct_light import UniformSphere
from taichi_tracer.integrators.other_technique import OtherTechnique, other_techniques
from taichi_tracer.integrators.path_settings import Bounces, PathSettings, check_bounces, check_terms
from taichi_tracer.lights.near_misses import begin_counting, counter_for
from taichi_tracer.picture import checkpoint
from taichi_tracer.picture.adaptive import Shares
from taichi_tracer.picture.aovs import as_channels, channel_names, find_aovs
from taichi_tracer.picture.error_curve import ErrorCurves, ErrorPoint
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.film import Film
from taichi_tracer.picture.heat import Scale
from taichi_tracer.picture.progress import Progress, Target, render_until
from taichi_tracer.ray import no_hit
from taichi_tracer.sampler import DEFAULT_SAMPLER, RandomNumbers, Sampler, UniformSampler, sampler_of
from taichi_tracer.scene_data import KEPT_FORMS, RayHits, SceneData, SceneInKernels
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.recent import Recent
from taichi_tracer.system.registry import PARTS, register
from taichi_tracer.system.seams import called, in_kernels, replaced, seams, why_replaced
from taichi_tracer.system.stopwatch import ERROR, EYE_RAYS, LIGHTS, SAMPLES, part
from taichi_tracer.tones.base import Tone
from taichi_tracer.tones.display import Display

if TYPE_CHECKING:
    from typing_extensions import Self

    from taichi_tracer.explain.explanation import Explanation

# The largest memory of a pixel: numbers in the running precision (on the film and in the kept hits), and other bytes.
NUMBERS_PER_PIXEL, BYTES_PER_PIXEL = 36, 52
COMPENSATED = Form("light samples", "of the light above the environment's mean", "samples of the BRDF find the rest")

SamplerChoice = str | Sampler | type[Sampler] | UniformSampler | type[UniformSampler]
IntegratorChoice = str | Integrator | type[Integrator] | Enum


@ti.data_oriented
class EyeRays:
    """The ray of every pixel and its hit, in the plain form: ``generate_ray``, then ``query_ray``.

    Args:
        traces: whether the ray is traced here. It is False if a replaced ``shade_ray`` traces the ray itself.
    """

    has_groups = False  # see ``fast.primary_hits``

    def __init__(self, scene_data: SceneData, camera: ProjectiveCamera, jitter: bool, traces: bool = True) -> None:
        self.camera, self.intersector = camera, scene_data.ray_intersector
        self.jitter, self.traces = jitter, traces
        self.forms, self.can_use_packets, self.use_packets = frozenset({"plain"}), False, False

    def bring_up_to_date(self, seed: int, index: int) -> None:
        """Do nothing: the plain form keeps no hits that could be out of date."""

    @ti.func
    def hit_of(self, x, y, rng):
        """(ray, HitData) of a pixel; the first pair of random numbers is the point within the pixel (A2-1)."""
        ray = through_pixel(self.camera.generate_ray, x, y, self.jitter, rng.next_2d())
        hit = no_hit()
        if ti.static(self.traces):
            hit = self.intersector.query_segment(ray, 0.0, tm.inf)
        return ray, hit


def not_a_scene(renderer: str, given: object) -> InputError:
    """The error for what was given to a renderer in place of a scene; a name or a path is no scene yet."""
    if isinstance(given, str | Path):
        return InputError(f"{renderer}: {str(given)!r} is no scene yet: give load_scene_data({str(given)!r})")
    return InputError(f"{renderer}: scene_data must be a scene, as load_scene_data returns it, not {given!r}")


def camera_of(
    chosen: ProjectiveCamera | type[ProjectiveCamera] | str | None, width: int, height: int, scene_data: SceneData
) -> ProjectiveCamera:
    """The given camera object, or a new camera of the given kind that shows the scene; None takes the scene's kind."""
    view = scene_data.view_for(width / height if min(width, height) > 0 else 1.0)  # the camera refuses a size of 0
    if chosen is None:
        return make_camera(width, height, **view)
    found = PARTS.find("camera", chosen)
    if isinstance(found, type):
        return make_camera(width, height, **change_projection(view, found))
    return found


@ti.data_oriented
@seams("shade_ray")
class ProgressiveRenderer:
    """A camera, a film, and one of the integrators that the subclass offers.

    Args:
        scene_data: the scene.
        width, height: size of the picture in pixels.
        camera: a camera object; then its size is the size of the picture. Or the name or the class of a camera: the
            renderer makes one that shows the scene. None takes the camera of the scene.
        jitter: whether eye rays pass through a random point of their pixel (A2-1); None takes the default of the class.
        sampler: the name of a registered sampler, or a ``Sampler``. If it is a ``UniformSampler``, the estimator
            ``uniform`` takes its directions from it.
        seed: the seed of the random numbers; the same seed gives the same picture.
        first_sample: the index of the first sample, so that disjoint ranges of samples can be rendered separately and
            then merged.
        crop: the pixels that take samples, see ``Film``.
        adaptive: whether pixels take samples in proportion to their standard deviation, see ``picture.adaptive``.
        integrator: what to render, by name or as an object; None is the first integrator that the class offers.
        fast: False runs only the plain forms; None takes the setting of the scene.

    Attributes:
        use_tiles: whether samples are taken tile by tile, where that is possible: see ``fast.tiles``. None takes them
            so if the picture will be rendered for so long that it is worth the compilation.
    """

    kind, name = "renderer", ""
    what = "view"  # the kind of integrators that it offers; messages use this word too
    jitters = False  # whether its pictures consist of random samples by default
    has_own_display = False  # whether exposure and tone curve are its own, and not those of the pictures beside it
    scale: Scale | None = None  # what the colours mean, if they stand for numbers

    def __init__(
        self,
        scene_data: SceneData,
        width: int = 512,
        height: int = 512,
        camera: ProjectiveCamera | type[ProjectiveCamera] | str | None = None,
        jitter: bool | None = None,
        sampler: SamplerChoice = DEFAULT_SAMPLER,
        seed: int = 0,
        first_sample: int = 0,
        crop: tuple[int, int, int, int] | None = None,
        adaptive: bool = False,
        integrator: IntegratorChoice | None = None,
        fast: bool | None = None,
    ) -> None:
        if not isinstance(scene_data, SceneData):
            raise not_a_scene(type(self).__name__, scene_data)
        scene_data.check_alive()
        for name, number in (("seed", seed), ("first_sample", first_sample)):
            if int(number) != number or not 0 <= number < 2**32:
                raise InputError(f"renderer: {name} must be a whole number from 0 to 2^32 - 1, not {number!r}")
        self.scene_data = scene_data
        self.camera = camera_of(camera, width, height, scene_data)
        self.width, self.height = self.camera.width, self.camera.height
        bytes_per_pixel = NUMBERS_PER_PIXEL * np.dtype(runtime.dtype()).itemsize + BYTES_PER_PIXEL
        memory.ask_for(self.width * self.height * bytes_per_pixel, f"a picture of {self.width}x{self.height} pixels")
        self.jitter = self.jitters if jitter is None else bool(jitter)
        self.is_random = self.jitter or self.jitters
        chosen = PARTS.find("sampler", sampler)
        directions = chosen if isinstance(chosen, UniformSampler) else None
        self.sampler: Sampler = sampler_of(
            chosen if directions is None else PARTS.find("sampler", DEFAULT_SAMPLER), self.camera
        )
        self.seed, self.first_sample = int(seed), int(first_sample)
        if adaptive and not self.is_random:
            raise InputError("renderer: adaptive sampling needs random samples: give jitter=True, or an estimator")
        self.adaptive, self.shares = bool(adaptive), Shares(self.width, self.height, bool(adaptive))
        has_halves, doubles = self.sampler.replicated or self.sampler.doubles, self.sampler.doubles
        keeps_deviation = self.adaptive or not has_halves
        self.film = Film(
            self.width, self.height, crop, self.sampler.replicated, keeps_deviation, self.is_random, doubles
        )
        self.fast = scene_data.fast if fast is None else bool(fast)
        self.replaced = replaced(self)
        self.eye_rays, self._form = self._make_eye_rays()
        self._integrators: dict[str, Integrator] = {}
        if directions is not None:
            self._integrators["uniform"] = UniformSphere(directions)
        self._shown: tuple | None = None  # the ``state`` to which the samples on the film belong
        self._counted_of: Any = None  # the environment whose near misses the film counts
        self._counters = Recent(KEPT_FORMS)
        self.progress = Progress(Target())
        self._seconds_before, self.error_curves = 0.0, ErrorCurves()
        self._passes = 0  # over all pixels, for all pictures so far
        self._timed: Any = None  # the estimator of ``_seconds_of_others``
        self._seconds_of_others = 0.0  # of rendering: of earlier pictures with the same estimator
        self._explainer: Any = None
        self._other: OtherTechnique | None = None
        self._tiles: Tiles | None = None
        self._view_tiles: ViewTiles | None = None
        self.use_tiles: bool | None = None
        self.display = Display()
        self.use(self.offers[0] if integrator is None else integrator)

    def _make_eye_rays(self, passes: float = math.inf, in_tiles: bool = False) -> tuple[Any, Any]:
        """The object that gives the kernel its rays and hits, and the ``Form`` that describes it.

        Args:
            passes: how many passes the picture will have; ∞ if this is unknown.
            in_tiles: whether samples are taken tile by tile.
        """
        form = kept_hits_form(self.scene_data, self.camera, self.sampler, self.fast)
        if "shade_ray" in self.replaced:
            form = plain_rays(why_replaced(self))
            return EyeRays(self.scene_data, self.camera, self.jitter, traces=False), form
        if form.is_fast and self.jitter and not in_tiles:
            why = why_not_kept(self.scene_data, self.camera, self.sampler, self.film.ranges, passes)
            form = plain_rays(why) if why else form
        if not form.is_fast:
            return EyeRays(self.scene_data, self.camera, self.jitter), form
        hits = PrimaryHits(
            self.scene_data, self.camera, self.jitter, self.sampler, shares=self.shares, ranges=self.film.ranges
        )
        hits.is_long = in_tiles or (self.jitter and passes < math.inf)  # new rays are kept only for the packets
        return hits, form

    def _expect(self, target: Target) -> None:
        """Choose the form of the eye rays, now that it is known how long the picture takes, if none is compiled yet.

        Earlier passes count, too: who has rendered much with a renderer will render more.
        """
        passes = target.passes(pixels_in(self.film.ranges))
        kept = self.eye_rays if isinstance(self.eye_rays, PrimaryHits) else None
        is_free = kept is None or (kept.traces == 0 and kept.use_packets is None)
        if is_free and passes > 1:  # single samples are those of a window, which goes on for as long as somebody looks
            eye_rays, form = self._make_eye_rays(passes + self._passes)
            if type(eye_rays) is not type(self.eye_rays):
                self.eye_rays, self._form = eye_rays, form
        if isinstance(self.eye_rays, PrimaryHits):
            self.eye_rays.passes = math.inf if target.spp is None else target.spp

    def share_eye_rays(self, other: "ProgressiveRenderer") -> None:
        """Use the kept hits of a renderer with the same samples, if they are the same: nothing more is compiled."""
        same = self.scene_data is other.scene_data and self.camera is other.camera and self.jitter == other.jitter
        are_kept = isinstance(self.eye_rays, PrimaryHits) and isinstance(other.eye_rays, PrimaryHits)
        if same and are_kept and self.film.ranges == other.film.ranges and not (self.adaptive or other.adaptive):
            self.eye_rays = other.eye_rays

    # ── what is rendered ──

    @classmethod
    def offered(cls) -> tuple[Integrator, ...]:
        """The registered integrators that this renderer can use."""
        return tuple(part for part in PARTS.all("integrator") if part.what == cls.what)

    @property
    def offers(self) -> tuple[Integrator, ...]:
        """The integrators of ``offered``, and those that were given to this renderer as objects."""
        known = {part.name: part for part in self.offered()}
        return tuple({**known, **self._integrators}.values())

    @classmethod
    def names(cls) -> list[str]:
        """The names of the integrators in ``offered``."""
        return [part.name for part in cls.offered()]

    def use(self, integrator: IntegratorChoice) -> "Self":
        """Choose what to render: the name of an integrator, or the integrator itself. Returns the renderer."""
        chosen: Any = getattr(integrator, "value", integrator)  # the name that a SampleMode stands for
        if isinstance(chosen, str):
            known = {name: part for part in self.offers for name in (part.name, *part.aliases)}
            if chosen not in known:
                raise one_of(self.what, chosen, [part.name for part in self.offers])
            chosen = known[chosen]
        else:
            chosen = PARTS.find("integrator", chosen)
            self._integrators[chosen.name] = chosen
        self.active = self._own(chosen)
        return self

    def _own(self, integrator: Integrator) -> Integrator:
        """This renderer's copy: an integrator may keep values of one picture, such as a range of depths."""
        return self._integrators.setdefault(integrator.name, copy.copy(integrator))

    @property
    def needs_light(self) -> bool:
        """Whether the integrator in use shows nothing in a scene without light."""
        return self.active.needs_light

    @property
    def explained(self) -> Integrator:
        """The integrator whose samples ``explain`` explains."""
        return self.active

    def controls(self) -> tuple[Control, ...]:
        """The values that can be changed while the picture is shown, as far as they have an effect at present."""
        return self.active.controls()

    def change(self, name: str, value: Any) -> None:
        """Change a value of ``controls``; see ``Integrator.change``."""
        self.active.change(name, value)

    @property
    def srgb(self) -> bool:
        """Whether the picture is radiance or colour; then it is written with the sRGB transfer function (C-14)."""
        return self.active.srgb

    def set_display(self, exposure: float | None = None, tone: str | Tone | None = None) -> "Self":
        """Choose how a picture of radiance is shown: in the window, in a notebook and in files of 8 bits.

        The samples, ``image()``, ``error()`` and floating-point files stay linear. Views of data are not changed.

        Args:
            exposure, tone: as for ``Display``; None leaves the setting as it is.
        """
        now = self.display
        self.display = Display(now.exposure if exposure is None else exposure, now.tone if tone is None else tone)
        return self

    @property
    def encoding(self) -> dict[str, Any]:
        """How ``save_image`` writes the picture: its arguments ``srgb``, ``exposure`` and ``tone``."""
        display = self.display if self.srgb else Display()
        return {"srgb": self.srgb, "exposure": display.exposure, "tone": display.tone}

    # ── the central kernel ──

    @ti.kernel
    def _take_sample(
        self,
        scene: ti.template(),
        integrator: ti.template(),
        eye_rays: ti.template(),
        near_misses: ti.template(),
        seed: ti.u32,
        index: ti.u32,
    ):
        for x, y in ti.ndrange(*self.film.ranges):
            i, is_taken = self.shares.sample_of(x, y, index)
            if is_taken:
                begin_counting(near_misses, x, y, integrator)
                rng = self.sampler.start(seed, x, y, i)
                ray, hit = eye_rays.hit_of(x, y, rng)
                self.record(x, y, self.radiance(scene, integrator, ray, hit, rng), i)

    @ti.func
    def record(self, x, y, value, index):
        """Give the value of a pixel to the film: as one sample, or as the final value if samples are not random."""
        if ti.static(self.is_random):
            self.film.add(x, y, value, index)
        else:
            self.film.put(x, y, value, index)

    @in_kernels
    def radiance(self, scene, integrator, ray, hit, rng):
        """One sample of the radiance along the ray, from the integrator or from a replaced ``shade_ray``."""
        if "shade_ray" in self.replaced:
            return called(self.shade_ray, ray)
        return integrator.radiance(scene, ray, hit, rng)

    @ti.func
    def shade_ray(self, ray):
        """One sample of the integrator in use, in the handout's form: this method traces the ray itself (A2-9)."""
        hit = self.scene_data.ray_intersector.query_segment(ray, 0.0, tm.inf)
        return self._shade_hit(ray, hit)

    @in_kernels
    def _shade_hit(self, ray, hit):
        rng = RandomNumbers.of_this_kernel()
        return self.active.radiance(self.kernel_scene(), ray, hit, rng)

    def kernel_scene(self) -> SceneInKernels:
        """The part of the scene that kernels use."""
        return self.scene_data.in_kernels(compensates=self.active.compensates)

    def add_sample(self, index: int) -> None:
        """Take one sample for every pixel."""
        self._passes += 1
        with part(LIGHTS):
            scene = self.kernel_scene()
            scene.lights.prepare(self.active.samples_lights)
        tiles = self._tiles_for(scene)
        with part(EYE_RAYS, waits=True):
            self.eye_rays.bring_up_to_date(self.seed, index)
        view_tiles = self._tiles_of_view()
        with part(SAMPLES, waits=True):
            if tiles is not None:
                tiles.take(self.film.near_misses, self.seed, index)
            elif view_tiles is not None:
                view_tiles.take(self, scene, self.active, self.seed, index)
            else:
                self._take_sample(scene, self.active, self.eye_rays, self.film.near_misses, self.seed, index)

    def _tiles_for(self, scene: SceneInKernels) -> Tiles | None:
        """What takes the samples of whole tiles, if it exists, or is possible and worth its compilation."""
        if self.use_tiles is False:
            return None
        if self._tiles is None or self._tiles.is_of != (scene, self.active):
            is_worth_it = bool(self.use_tiles) or is_worth_tiles(
                self.progress, self._seconds_before, self._seconds_of_others
            )
            is_possible = is_worth_it and can_take_tiles(self, scene, self.active)
            if is_possible and isinstance(self.eye_rays, EyeRays):
                self.eye_rays, self._form = self._make_eye_rays(in_tiles=True)
            self._tiles = Tiles(self, scene, self.active) if is_possible else None
        return self._tiles

    def _tiles_of_view(self) -> ViewTiles | None:
        """What gives the pixels of a view their colours tile by tile, if that is possible."""
        if self.use_tiles is False or not can_show(self):
            return None
        if self._view_tiles is None or self._view_tiles.hits is not self.eye_rays:
            self._view_tiles = ViewTiles(self.eye_rays, self.film.ranges)
        return self._view_tiles

    @property
    def forms(self) -> frozenset:
        """The forms of the kernels that were used so far: a new one means that a kernel was compiled."""
        return self.eye_rays.forms if self._tiles is None else self.eye_rays.forms | {"tiles"}

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
        if self._timed is not self.active:
            self._timed, self._seconds_of_others = self.active, 0.0
        elif not is_continued:
            self._seconds_of_others += self.rendered_seconds
        self._seconds_before = self.rendered_seconds if is_continued else 0.0
        target = Target(1 if spp is None and time is None and error is None else spp, time, error)
        self._expect(target)
        render_until(self, target, watch)
        return self

    # ── whether the samples belong to the present state ──

    def state(self) -> tuple:
        """Everything that the picture depends on. Samples of different states must not be added up."""
        scene = self.scene_data
        sky = 0 if scene.environment is None else scene.environment.version
        values = sum(integrator.version for integrator in self._integrators.values())
        lights = tuple(light.version for light in scene.lights)
        return self.active, values, self.camera.version, scene.version, sky, *lights

    def is_current(self) -> bool:
        """Whether the samples on the film belong to the present ``state``."""
        return self._shown == self.state()

    def reset(self) -> None:
        """Forget the samples, so that the next ``render`` starts the picture again."""
        self.film.reset()
        self.error_curves.begin(self.active.name, self.state()[1:])

    def begin(self) -> None:
        """Start the picture again, in the present ``state``."""
        with part(LIGHTS, waits=True):
            self._count_near_misses()
        self.reset()
        self.active.prepare(self.scene_data, self.camera)
        self._shown = self.state()

    def _count_near_misses(self) -> None:
        """Give the film a counter of near misses of the present environment, if light can be missed."""
        environment = self.scene_data.environment if self.active.srgb else None
        is_over = self.film.near_misses is not None and self.film.near_misses.is_over()
        if environment is not self._counted_of or is_over:
            if is_over:
                self._counters = Recent(KEPT_FORMS)
            self.film.near_misses = None if environment is None else self._counter()
            self._counted_of = environment

    def _counter(self) -> Any:
        """The counter of near misses for the scene as it is, see ``counter_for``."""
        scene = self.kernel_scene()
        return self._counters.get(scene, lambda: counter_for(scene, self.width, self.height))

    def begin_anew(self) -> None:
        """Let the next ``render`` start again after a change of the seed; adaptive sampling takes a new pilot."""
        self.reset()
        self._shown = None

    # ── the picture, and what is known about it ──

    @property
    def samples(self) -> int:
        """Samples per pixel on the film; with adaptive sampling, the mean over all pixels."""
        return round(self.film.samples * self.shares.mean)

    @property
    def canvas(self) -> Any:
        """The Taichi field [x, y] of RGB vectors, with y up, that ``ti.ui`` shows."""
        self.film.check_alive()
        self.film.show()
        return self.film.canvas

    @property
    def non_finite(self) -> int:
        """How many samples were not finite and therefore not added; ``film.non_finite_samples`` lists them."""
        return self.film.non_finite

    def error(self) -> RelativeError:
        """Relative RMSE of the picture, estimated from its samples, with its 95 % interval; see ``error_estimate``."""
        with part(ERROR, waits=True):
            error = self.film.error(self._missed_light())
        if error > 0:
            self.error_curves.add(self.active.name, ErrorPoint(self.samples, self.rendered_seconds, error))
        return error

    def _missed_light(self) -> float:
        """What only a technique finds that the integrator in use has not, see ``integrators.other_technique``."""
        scene, crop = self.kernel_scene(), self.film.crop
        pixels = (crop[1] - crop[0]) * (crop[3] - crop[2])
        techniques = () if self.replaced else other_techniques(scene, self.active, pixels)
        if not techniques or self.samples == 0:
            return 0.0
        if self._other is None or self._other.is_of != (scene, self.active, crop, techniques):
            eyes = EyeRays(self.scene_data, self.camera, self.jitter)
            self._other = OtherTechnique(scene, self.active, self.sampler, eyes, crop, techniques)
        self._other.look((self._shown, self.seed), self.seed)
        return self._other.missed(self.samples)

    @property
    def rendered_seconds(self) -> float:
        """Seconds of rendering the samples of this picture, without compilation."""
        return self._seconds_before + self.progress.seconds

    @property
    def error_curve(self) -> list[ErrorPoint]:
        """How the error of this picture fell: (samples, seconds, error) of every look at it.

        ``error()`` looks, and so does ``render`` with a target of time or error, or with ``watch``. ``error_curves``
        has the curves of all integrators that were tried, by name, until the camera, the scene or the light changes.
        """
        return self.error_curves.get(self.active.name, [])

    def error_image(self) -> np.ndarray:
        """(height, width, 3) float32, top row first: the standard error of every pixel; NaN if it is unknown.

        With the low-discrepancy sampler, the value of a pixel comes from a single difference and is rough. Means over
        regions of many pixels are reliable.
        """
        return self.film.standard_error()

    def image(self) -> Picture:
        """(height, width, 3) float32, linear, top row first. If there is no sample of it yet, one is rendered.

        The array knows whether it is light (``srgb``), so that ``save_image`` writes it as ``save`` does.
        """
        self.scene_data.check_alive()
        if self.samples == 0 or not self.is_current():
            self.render()
        return Picture(self.film.image(), self.srgb)

    def aov(self, name: str) -> np.ndarray:
        """A raw array: what the rays through the centres of the pixels hit, whatever the picture shows.

        Args:
            name: "distance", (height, width), from the eye, infinite for a miss; "position" and "normal",
                (height, width, 3) in world space, and "barycentric", (height, width, 2), the weights (u, v) of the
                second and the third vertex: NaN for a miss; "triangle_id" and "material_id", (height, width), −1 for a
                miss.

        Returns:
            The array in the layout of ``image()``: top row first. Ids are int32, the others have the running precision.
        """
        (aov,) = find_aovs(name)
        return self._as_image(aov.of(self._hits()))

    def _hits(self) -> RayHits:
        """What the rays through the centres of all pixels hit, row by row from the top."""
        y, x = np.mgrid[self.height - 1 : -1 : -1, : self.width]
        return self.scene_data.intersect(*self.camera.rays(x, y))

    def _as_image(self, rows: np.ndarray) -> np.ndarray:
        """(height, width, …) from an array with one row per pixel."""
        return rows.reshape(self.height, self.width, *rows.shape[1:])

    def save(self, path: str | Path, aovs: Sequence[str] = ()) -> None:
        """Write the picture so far in the format of the path's extension; it is rendered first if it has no sample.

        Only the crop is written. In 8-bit formats, radiance gets the exposure and the tone curve of ``set_display`` and
        the sRGB transfer function, and data does not (C-14).

        Args:
            aovs: names of raw arrays, see ``aov``, that an EXR file has beside the picture as channels of float32:
                Z for the distance, N.X, N.Y, N.Z for the normal, P.X … for the position, triangle_id, material_id,
                barycentric.u and barycentric.v.
        """
        check_writable(path, channel_names(find_aovs(aovs)))
        channels = self.channels(aovs)  # first, because the picture may take hours
        save_image(path, self.film.own_pixels(self.image()), channels=channels, **self.encoding)

    def channels(self, aovs: Sequence[str]) -> dict[str, np.ndarray]:
        """Name → (height, width) array of the crop, for each channel that some AOVs have in an EXR file."""
        chosen = find_aovs(aovs)
        found: dict[str, np.ndarray] = {}
        hits = self._hits() if chosen else None
        for aov in chosen:
            found |= as_channels(aov, self.film.own_pixels(self._as_image(aov.of(hits))))
        return found

    def notes(self) -> list[str]:
        """What the user should know about the picture; nothing if a replaced method decides what is shown."""
        own = {"shade_ray", f"shade_{self.active.name}"} & set(self.replaced)
        return [] if own else self.active.notes()

    def receipt(self) -> list[str]:
        """One line per effect and per form: what is simulated, which form runs, and why."""
        lines = [*self.scene_data.receipt(), str(self._form)]
        if self._tiles is not None:
            lines.append(str(TILES))
        if self.active.compensates and self.kernel_scene().compensates:
            lines.append(str(COMPENSATED))
        if self.replaced:
            lines.append(f"{'shading':<15} as it is written: {why_replaced(self)}")
        return lines

    def explain(self, column: int, row: int, sample: int = 0, samples: int | None = None) -> "Explanation":
        """Every number on the way from a pixel to its colour, for one of its samples; see ``explain``.

        The parts of this picture compute the pixel's samples once more, so that the numbers are those of the picture:
        ``explanation.mean`` is ``image()[row, column]``, to the last bit, if the samples are those of ``render``.

        Args:
            column, row: the pixel, counted from the left and from the top.
            sample: which of its samples, counted from 0.
            samples: how many samples the pixel has; None takes as many as the picture has.

        Raises:
            InputError: the picture has no such pixel, or the pixel no such sample.
        """
        from taichi_tracer.explain.pixel import PixelExplainer, check_pixel

        self.scene_data.check_alive()
        if not self.is_current():
            self.begin()
        samples = max(1, self.film.samples) if samples is None else samples
        check_pixel(self, column, row, sample, samples)
        scene = self.kernel_scene()
        scene.lights.prepare(self.active.samples_lights)
        if self._explainer is None or not self._explainer.is_of(scene, self.explained, self.camera):
            eyes = EyeRays(self.scene_data, self.camera, self.jitter, "shade_ray" not in self.replaced)
            self._explainer = PixelExplainer(self, scene, self.explained, eyes)
        return self._explainer.explain(column, row, sample, samples)

    def facts(self) -> dict[str, Any]:
        """Everything that the bits of the picture depend on, for checkpoints; see ``picture.checkpoint``."""
        return checkpoint.facts_of(self)

    def save_checkpoint(self, path: str | Path) -> None:
        """Write the samples into a file, so that ``load_checkpoint`` can continue the picture later."""
        checkpoint.save(self, path)

    def load_checkpoint(self, path: str | Path) -> None:
        """Continue from a checkpoint: ``render`` then adds the samples that come next.

        Raises:
            InputError: the file is damaged, or its samples belong to another picture. The renderer has not changed.
        """
        checkpoint.load(self, path)

    def _repr_png_(self) -> bytes:
        """The picture so far, for notebooks."""
        from taichi_tracer.files.images import encode_png

        return encode_png(self.image(), self.srgb, self.display if self.srgb else Display())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.active.name}, {self.width}×{self.height}, {self.samples} samples)"


@register
@seams("shade_hit", "shade_triangle_id", "shade_distance", "shade_barycentric", "shade_normal", "shade_material_id")
class A1Renderer(ProgressiveRenderer):
    """Assignment 1: what did the eye ray hit? Six views of the hit (A1-15)."""

    name, what = "A1Renderer", "view"

    @in_kernels
    def radiance(self, scene, integrator, ray, hit, rng):
        """The colour from a replaced ``shade_ray``, a replaced method of the view in use, or the view itself."""
        own = f"shade_{integrator.name}"
        if "shade_ray" not in self.replaced and own in self.replaced:
            return called(getattr(self, own), hit)
        return ProgressiveRenderer.radiance(self, scene, integrator, ray, hit, rng)

    @property
    def max_distance(self) -> float:
        """The distance that the view "Distance" shows white; see ``surface_views.Distance``. It may be assigned."""
        view: Any = self._own(PARTS.find("integrator", "distance"))
        if not impl.inside_kernel():
            view.fit(self.scene_data, self.camera)
        return view.max_distance

    @max_distance.setter
    def max_distance(self, distance: float | None) -> None:
        view: Any = self._own(PARTS.find("integrator", "distance"))
        view.max_distance = distance

    def begin(self) -> None:
        """Start the picture again; replaced methods may call ``shade_distance`` or read ``max_distance`` themselves."""
        super().begin()
        if self.replaced:
            self._own(PARTS.find("integrator", "distance")).prepare(self.scene_data, self.camera)

    @in_kernels
    def _view(self, name: str, hit_data):
        view = self._own(PARTS.find("integrator", name))
        return view.radiance(self.scene_data.in_kernels(), None, hit_data, None)

    @ti.func
    def shade_hit(self, hit_data):
        """White for front faces, dark red for back faces, black for no hit."""
        return self._view("hit", hit_data)

    @ti.func
    def shade_triangle_id(self, hit_data):
        """A colour per triangle."""
        return self._view("triangle_id", hit_data)

    @ti.func
    def shade_distance(self, hit_data):
        """Black at the eye, white at ``max_distance`` and beyond."""
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

    def set_shade_hit(self) -> "Self":
        """Show the view "Hit"; the same as use("hit")."""
        return self.use("hit")

    def set_shade_triangle_id(self) -> "Self":
        """Show the view "Triangle ID"."""
        return self.use("triangle_id")

    def set_shade_triangle_ID(self) -> "Self":  # noqa: N802 (the handout's spelling)
        """Show the view "Triangle ID"."""
        return self.use("triangle_id")

    def set_shade_distance(self) -> "Self":
        """Show the view "Distance"."""
        return self.use("distance")

    def set_shade_barycentric(self) -> "Self":
        """Show the view "Barycentric"."""
        return self.use("barycentric")

    def set_shade_barycentrics(self) -> "Self":
        """Show the view "Barycentric"."""
        return self.use("barycentric")

    def set_shade_normal(self) -> "Self":
        """Show the view "Normal"."""
        return self.use("normal")

    def set_shade_normals(self) -> "Self":
        """Show the view "Normal"."""
        return self.use("normal")

    def set_shade_material_id(self) -> "Self":
        """Show the view "Material ID"."""
        return self.use("material_id")

    def set_shade_material_ID(self) -> "Self":  # noqa: N802 (the handout's spelling)
        """Show the view "Material ID"."""
        return self.use("material_id")


def warn_if_dark(scene_data: SceneData) -> None:
    """Warn the caller of ``render`` if nothing in a scene emits light."""
    if scene_data.effects.is_dark:
        advice = "give it an environment, such as 'studio', or a material with Ke > 0"
        warnings.warn(f"nothing in this scene emits light: {advice}", stacklevel=5)


@register
@seams()
class A2Renderer(ProgressiveRenderer):
    """Assignment 2: direct illumination by the environment, with Monte Carlo estimators (A2-3, A2-9)."""

    name, what, jitters = "A2Renderer", "estimator", True

    class SampleMode(Enum):
        """The estimators, as the handout names them."""

        UNIFORM = "uniform"
        HEMISPHERE = "hemisphere"
        BRDF = "brdf"
        ENVIRONMENT = "environment"
        MIS = "mis"
        MIS_BALANCE = "mis_balance"

    SamplingMode = SampleMode

    def begin(self) -> None:
        """Start the picture again; warn if nothing in the scene emits light."""
        super().begin()
        warn_if_dark(self.scene_data)

    def set_sample_uniform(self) -> "Self":
        """Sample directions uniform on the sphere."""
        return self.use("uniform")

    def set_sample_uniform_sphere(self) -> "Self":
        """Sample directions uniform on the sphere."""
        return self.use("uniform")

    def set_sample_hemisphere(self) -> "Self":
        """Sample directions uniform on the hemisphere around the normal."""
        return self.use("hemisphere")

    def set_sample_uniform_hemisphere(self) -> "Self":
        """Sample directions uniform on the hemisphere around the normal."""
        return self.use("hemisphere")

    def set_sample_brdf(self) -> "Self":
        """Sample directions from the density of the BRDF."""
        return self.use("brdf")

    def set_sample_environment(self) -> "Self":
        """Sample directions in proportion to the light of the environment."""
        return self.use("environment")

    def set_sample_light(self) -> "Self":
        """Sample directions in proportion to the light of the environment."""
        return self.use("environment")

    def set_sample_mis(self) -> "Self":
        """Use multiple importance sampling with the power heuristic."""
        return self.use("mis")

    def set_sample_mis_power(self) -> "Self":
        """Use multiple importance sampling with the power heuristic."""
        return self.use("mis")

    def set_sample_mis_balance(self) -> "Self":
        """Use multiple importance sampling with the balance heuristic."""
        return self.use("mis_balance")


@register
@seams()
class A3Renderer(A2Renderer):
    """Assignment 3: direct illumination by surfaces that emit and by the environment (A3-1 … A3-5).

    It has the estimators of ``A2Renderer``, which sample lamps, too, where a scene has some. The estimator
    ``mis_one_sample`` has the weights ``mis_plight`` and ``mis_pbrdf``.
    """

    name = "A3Renderer"

    @property
    def mis_plight(self) -> float:
        """The weight with which ``mis_one_sample`` samples the lights (A3-4)."""
        return self._one_sample().weights[0]

    @mis_plight.setter
    def mis_plight(self, weight: float) -> None:
        self.set_weights(mis_plight=weight)

    @property
    def mis_pbrdf(self) -> float:
        """The weight with which ``mis_one_sample`` samples the BRDF (A3-4)."""
        return self._one_sample().weights[1]

    @mis_pbrdf.setter
    def mis_pbrdf(self, weight: float) -> None:
        self.set_weights(mis_pbrdf=weight)

    def set_weights(self, mis_plight: float | None = None, mis_pbrdf: float | None = None) -> "Self":
        """Change one of the weights, or both at once; None leaves a weight as it is. Returns the renderer."""
        light, brdf = self._one_sample().weights
        light, brdf = light if mis_plight is None else mis_plight, brdf if mis_pbrdf is None else mis_pbrdf
        self._one_sample().set_weights(light, brdf)
        return self

    def _one_sample(self) -> Any:
        """This renderer's copy of the integrator."""
        name = "mis_one_sample"
        return self._integrators.setdefault(name, copy.copy(PARTS.find("integrator", name)))

    def set_sample_mis_one_sample(self) -> "Self":
        """Use multiple importance sampling with one sample, drawn by lot (A3-4)."""
        return self.use("mis_one_sample")


@register
@seams()
class A4Renderer(ProgressiveRenderer):
    """Assignment 4: paths, on which light bounces from surface to surface (A4-1 … A4-5).

    ``max_bounces`` and the other properties may be set at any time; the picture then starts again.
    """

    name, what, jitters = "A4Renderer", "path", True

    @functools.cached_property
    def path_settings(self) -> PathSettings:
        """How long paths are; every integrator of this renderer has the same object."""
        return PathSettings()

    def use(self, integrator: IntegratorChoice) -> "Self":
        """Choose how light is found; the length of paths stays. Returns the renderer."""
        super().use(integrator)
        paths: Any = self.active
        paths.settings = self.path_settings
        return self

    def receipt(self) -> list[str]:
        """One line per effect and per form; then how many bounces are simulated, and whether roulette ends paths."""
        return [*super().receipt(), *self.path_settings.receipt(self.scene_data.effects)]

    @property
    def max_bounces(self) -> int:
        """How many surfaces may reflect, from 0 to 64: 0 shows only what emits, 1 is direct light (A4-2)."""
        return self.path_settings["max_bounces"]

    @max_bounces.setter
    def max_bounces(self, value: int) -> None:
        self.path_settings.set(max_bounces=value)

    @property
    def rr_start_bounce(self) -> int:
        """After so many bounces, Russian roulette may end a path (A4-2)."""
        return self.path_settings["rr_start_bounce"]

    @rr_start_bounce.setter
    def rr_start_bounce(self, value: int) -> None:
        self.path_settings.set(rr_start_bounce=value)

    @property
    def rr_termination_probability(self) -> float:
        """The probability with which roulette ends a path after each further bounce (A4-2)."""
        return self.path_settings["rr_termination_probability"]

    @rr_termination_probability.setter
    def rr_termination_probability(self, value: float) -> None:
        self.path_settings.set(rr_termination_probability=value)

    @property
    def roulette(self) -> str:
        """How roulette chooses this probability: "course" takes the constant, "throughput" the light still to come."""
        return self.path_settings["roulette"]

    @roulette.setter
    def roulette(self, value: str) -> None:
        self.path_settings.set(roulette=value)

    @property
    def bounces(self) -> Bounces | None:
        """(first, last): only light after so many bounces counts; a last of None is no end; None counts all (A4-5)."""
        return self.path_settings["bounces"]

    @bounces.setter
    def bounces(self, value: Bounces | None) -> None:
        self.path_settings.set(bounces=value)

    def pictures_by_bounce(
        self, spp: int = 1, bounces: Sequence[int | Bounces] | None = None
    ) -> dict[int | Bounces, Picture]:
        """One picture for the light after each number of bounces; their sum is the picture of all of them (A4-5).

        Every picture is rendered with the same random numbers, and therefore of the same paths. They add up to the
        picture of ``spp`` samples but for rounding: in f32, to about 1e-7 of the brightest value. The paths of a
        picture end after the last bounce that counts in it. Afterwards, ``bounces`` is as before, and the next
        ``render`` starts the picture again.

        Args:
            spp: samples per pixel of each picture.
            bounces: what each picture counts: a number, or (first, last) as for the attribute ``bounces``. None gives
                a picture for each number from 0 to ``max_bounces``.

        Returns:
            The members of ``bounces`` with their pictures, in the same order.

        Raises:
            InputError: a number of bounces is named twice, or is more than ``max_bounces``; or the renderer is
                adaptive, so that each picture would take its samples in other pixels.
        """
        asked = list(range(self.max_bounces + 1)) if bounces is None else list(bounces)
        terms = [(one, one) if isinstance(one, int) else one for one in asked]
        for term in terms:
            check_bounces(term)
        check_terms(terms, self.max_bounces)
        if self.adaptive:
            raise InputError("pictures by bounce need the same samples in all of them: give adaptive=False")
        former, found = self.bounces, {}
        try:
            for one, term in zip(asked, terms, strict=True):
                self.bounces = term
                self.begin_anew()
                found[one] = self.render(spp).image()
        finally:
            self.bounces = former
            self.begin_anew()
        return found

    def begin(self) -> None:
        """Start the picture again; warn if nothing in the scene emits light."""
        super().begin()
        warn_if_dark(self.scene_data)

    def set_shading_implicit(self) -> "Self":
        """Let paths find lights by chance: ``implicit`` (A4-1)."""
        return self.use("implicit")

    def set_shading_explicit(self) -> "Self":
        """Take a sample of the lights at every surface: ``explicit`` (A4-1)."""
        return self.use("explicit")

    def set_shading_mis(self) -> "Self":
        """Combine both by the power heuristic: ``path`` (A3-4, A4-1)."""
        return self.use("path")
