"""What a renderer is made of: a scene, a camera, a sampler, a film, and the integrators that it offers."""

from __future__ import annotations

import copy
import functools
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_tracer.camera import ProjectiveCamera, change_projection, make_camera
from taichi_tracer.integrators.base import Control, Integrator
from taichi_tracer.integrators.direct_light import UniformSphere
from taichi_tracer.integrators.path_settings import PathSettings
from taichi_tracer.integrators.scene_in_kernels import SceneInKernels
from taichi_tracer.options import RENDERER_DEFAULTS, CameraChoice, RendererOptions, all_options, with_options
from taichi_tracer.picture.adaptive import Shares
from taichi_tracer.picture.film import Film
from taichi_tracer.picture.progress import ErrorPoint, Progress, Target
from taichi_tracer.picture.rendered import RenderedPicture
from taichi_tracer.picture.sample_parts import EyeRays, SampleParts
from taichi_tracer.sampler import Sampler, UniformSampler, sampler_of, usual_sampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.compile_time import one_at_a_time
from taichi_tracer.system.course_fields import held
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.own_code.checks import Values
from taichi_tracer.system.parts import PARTS, KnownAttributes, replaced, why_replaced
from taichi_tracer.tones.display import Display
from taichi_tracer.tones.heat import Scale
from taichi_tracer.unseen.unseen_light import find_rare_light

if TYPE_CHECKING:
    from typing_extensions import Self, Unpack

# The largest memory of a pixel: numbers in the running precision (on the film and in the kept hits), and other bytes.
NUMBERS_PER_PIXEL, BYTES_PER_PIXEL = 39, 52
COMPENSATED = "light samples   of the light above the environment's mean: samples of the BRDF find the rest"

IntegratorChoice = str | Integrator | type[Integrator] | Enum


def unknown_integrator(renderer: RendererParts, chosen: str) -> InputError:
    """The error for the name of what a renderer does not offer; it says which other does."""
    message = str(one_of(renderer.what, chosen, [part.name for part in renderer.offers]))
    other = next((part for part in PARTS.all("integrator") if chosen in (part.name, *part.aliases)), None)
    if other is not None:
        owners = [cls.__name__ for cls in PARTS.all("renderer") if other in cls.offered()]
        message += f". It belongs to {' and '.join(owners) or 'another renderer'}"
    return InputError(message)


def whole(name: str, number: int) -> int:
    """A whole number of 32 bits; an InputError for anything else."""
    if not isinstance(number, int | float | np.number) or int(number) != number or not 0 <= number < 2**32:
        raise InputError(f"renderer: {name} must be a whole number from 0 to 2^32 - 1, not {number!r}")
    return int(number)


def camera_of(chosen: CameraChoice, width: int, height: int, scene_data: SceneData) -> ProjectiveCamera:
    """The given camera object, or a new camera of the given kind that shows the scene; None takes the scene's kind."""
    is_size = all(isinstance(side, int | float | np.number) and side > 0 for side in (width, height))
    view = scene_data.view_for(width / height if is_size else 1.0)  # the camera refuses what is no size
    found = PARTS.find("camera", view.get("projection", "perspective") if chosen is None else chosen)
    if isinstance(found, type):
        return make_camera(width, height, **change_projection(view, found))
    return found


class Value:
    """A value of what a renderer renders, as its own; kernels read it, and it has ``[None]``, as in the course.

    Attributes:
        of: the attribute of the renderer that has the value under its ``name``.
    """

    of = "path_settings"

    def __init__(self, name: str, meaning: str) -> None:
        self.name, self.__doc__ = name, meaning

    def __get__(self, renderer: Any, owner: type | None = None) -> Any:
        if renderer is None:
            return self
        return held(getattr(renderer, self.of)[self.name], functools.partial(self.assign, renderer))

    def __set__(self, renderer: Any, value: Any) -> None:
        getattr(renderer, self.of).set(**{self.name: value})

    def assign(self, renderer: Any, value: Any) -> None:
        """What an assignment to ``[None]`` does."""
        self.__set__(renderer, value)


class PathValues:
    """How long the paths of a renderer are, as its attributes; after a change, the picture starts again."""

    @functools.cached_property
    def path_settings(self) -> PathSettings:
        """How long paths are; all integrators of the renderer have the same object."""
        return PathSettings()

    max_bounces = Value(
        "max_bounces", "How many surfaces may reflect, 0 to 64: 0 is emitted light, 1 adds direct (A4-2)."
    )
    rr_start_bounce = Value("rr_start_bounce", "After so many bounces, Russian roulette may end a path (A4-2).")
    rr_termination_probability = Value(
        "rr_termination_probability", "With it, roulette ends a path after each further bounce (A4-2)."
    )
    rr_termination_probabilty = rr_termination_probability  # the course's spelling
    roulette = Value(
        "roulette",
        'How roulette chooses this probability: "course" takes the constant, "throughput" the light still to come.',
    )
    bounces = Value(
        "bounces",
        "(first, last): only light after so many bounces counts; a last of None is no end; None counts all (A4-5).",
    )


class RendererParts(KnownAttributes, RenderedPicture):
    """The parts of a renderer, and the choice of its integrator; ``ProgressiveRenderer`` takes samples with them.

    Args:
        scene_data: the scene. width, height: size of the picture in pixels. options: ``options.RendererOptions``.
    """

    kind, name = "renderer", ""
    what = "view"  # the kind of integrators that it offers; messages use this word too
    asked: tuple[str, ...] = ()  # what an assignment asks for; () is all that it offers
    first = ""  # the integrator with which it begins; the first that it offers if there is no name
    jitters = False  # whether its pictures consist of random samples by default
    has_own_display = False  # whether exposure and tone curve are its own, and not those of the pictures beside it
    value_names: tuple[str, ...] = ()  # which of ``settings.OPTIONS`` it has as values
    scale: Scale | None = None  # what the colours mean, if they show numbers

    @one_at_a_time
    @with_options(RendererOptions, RENDERER_DEFAULTS)
    def __init__(
        self, scene_data: SceneData, width: int = 512, height: int = 512, **options: Unpack[RendererOptions]
    ) -> None:
        given = all_options(type(self).__name__, options, RENDERER_DEFAULTS)
        if not isinstance(scene_data, SceneData):
            text = f"scene_data must be a scene, as load_scene_data returns it, not {scene_data!r}"
            if isinstance(scene_data, str | Path):
                text = f"{str(scene_data)!r} is no scene yet: give load_scene_data({str(scene_data)!r})"
            raise InputError(f"{type(self).__name__}: {text}")
        scene_data.check_alive()
        self.scene_data = scene_data
        self.seed = whole("seed", given["seed"])  # the same random numbers for the same seed
        self.first_sample = whole("first_sample", given["first_sample"])
        self.camera = camera_of(given["camera"], width, height, scene_data)
        self.width, self.height = self.camera.width, self.camera.height
        bytes_per_pixel = NUMBERS_PER_PIXEL * np.dtype(runtime.dtype()).itemsize + BYTES_PER_PIXEL
        memory.ask_for(self.width * self.height * bytes_per_pixel, f"a picture of {self.width}x{self.height} pixels")
        self.jitter = self.jitters if given["jitter"] is None else bool(given["jitter"])
        self.is_random = self.jitter or self.jitters
        self.adaptive: bool | None = given["adaptive"]
        if self.adaptive and not self.is_random:
            raise InputError("renderer: adaptive sampling needs random samples: give jitter=True, or an estimator")
        self._integrators: dict[str, Integrator] = {}
        usual = usual_sampler(bool(self.adaptive))
        chosen = PARTS.find("sampler", usual if given["sampler"] is None else given["sampler"])
        if isinstance(chosen, UniformSampler):
            self._integrators["uniform"], chosen = UniformSphere(chosen), PARTS.find("sampler", usual)
        self.sampler: Sampler = sampler_of(chosen, self.camera)
        self.shares = Shares(self.width, self.height)
        of = self.sampler  # what the estimate of the error needs to know
        self.film = Film(self.width, self.height, given["crop"], of.replicated, self.is_random, of.doubles)
        self.replaced = replaced(self)
        self.eye_rays = self.make_eye_rays()
        self._ready: SampleParts | None = None  # of the kernel that was launched last
        self._compiled_for: Values | None = None  # the numbers of own parts that are constants of the kernels
        self._shown: tuple | None = None  # the ``state`` to which the samples on the film belong
        self.progress = Progress(Target())
        self.seconds_before = 0.0
        self.error_curves: dict[str, list[ErrorPoint]] = {}
        self._curves_of: tuple | None = None  # the ``state`` to which they belong
        self.explainer: Any = None
        self._of_sample: Any = None  # while a replaced ``shade_ray`` is compiled: the scene and the random numbers
        self._searched: tuple | None = None  # the ``state`` for which ``find_rare_light`` was called last
        self.display = Display()
        self.use(given["integrator"] or self.first or self.offers[0].name)

    def make_eye_rays(self) -> EyeRays:
        """What gives the kernel its rays and hits; a replaced ``shade_ray`` traces its rays itself."""
        return EyeRays(self.scene_data, self.camera, self.jitter, "shade_ray" not in self.replaced)

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

    def use(self, integrator: IntegratorChoice) -> Self:
        """Choose what to render. Returns the renderer.

        Args:
            integrator: its name, or the integrator itself.
        """
        chosen: Any = integrator.name.lower() if isinstance(integrator, Enum) else integrator
        if isinstance(chosen, str):
            known = {name: part for part in self.offers for name in (part.name, *part.aliases)}
            if chosen not in known:
                raise unknown_integrator(self, chosen)
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
        """Whether what is rendered shows nothing in a scene without light."""
        return self.explained.needs_light

    @property
    def shows_light(self) -> bool:
        """Whether the picture is of light, of which its samples may miss some: see ``unseen.unseen_light``."""
        return self.srgb

    @property
    def explained(self) -> Integrator:
        """The integrator whose samples the picture takes, and ``explain`` explains."""
        return self.active

    def controls(self) -> tuple[Control, ...]:
        """The values that can be changed while the picture is shown, as far as they have an effect at present."""
        return self.explained.controls()

    def values(self) -> dict[str, Any]:
        """Name → present value of each of ``value_names``, in use or not."""
        return {name: copy.copy(getattr(self, name)) for name in self.value_names}

    def change(self, name: str, value: Any) -> None:
        """Change a value of ``controls``, or one of ``value_names``; see ``Integrator.change``."""
        if name in self.value_names:
            setattr(self, name, value)
        else:
            self.explained.change(name, value)

    @property
    def srgb(self) -> bool:
        """Whether the picture is radiance or colour; then it is written with the sRGB transfer function (C-14)."""
        return self.active.srgb

    def plain_sample_parts(self, scene: SceneInKernels, integrator: Integrator) -> SampleParts:
        """The parts of a sample, for who explains it.

        Every pixel takes every sample: ``shares.range_of`` has the indices of those that it took in the picture.
        """
        shares = Shares(self.width, self.height)
        return SampleParts(scene, integrator, self.make_eye_rays(), self.sampler, shares, self.film)

    def kernel_scene(self) -> SceneInKernels:
        """The part of the scene that kernels use."""
        return self.scene_data.in_kernels(compensates=self.active.compensates, microfacets=self.active.microfacets)

    def find_rare_light(self) -> None:
        """Tell the film what samples of the present picture find rarely, see ``unseen.unseen_light``; once for each."""
        if self._searched != self._shown:
            self.film.rare, self._searched = find_rare_light(self), self._shown

    def notes(self) -> list[str]:
        """What the user should know about the picture; nothing if a replaced method decides what is shown."""
        own = {"shade_ray", f"shade_{self.active.name}"} & set(self.replaced)
        return [] if own else self.active.notes()

    def receipt(self) -> list[str]:
        """One line per effect: what is simulated, and why."""
        lines = self.scene_data.receipt(self.active.microfacets)
        if self.active.compensates and self.kernel_scene().compensates:
            lines.append(COMPENSATED)
        lines += self.shares.receipt()
        if self.replaced:
            lines.append(f"{'shading':<15} as it is written: {why_replaced(self)}")
        return lines

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.active.name}, {self.width}×{self.height}, {self.samples} samples)"
