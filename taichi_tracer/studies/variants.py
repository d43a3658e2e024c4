"""The ways to render one picture that a study of accuracy compares, their scenes, and how they are rendered.

They are rendered in a process of their own, or in a thread if the scene is the caller's.
"""

import math
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import taichi as ti

from taichi_tracer.environment import LOOKUPS, Environment, load_environment
from taichi_tracer.integrators import path_settings
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.picture.metrics import blocks_of, relative_rmse
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A2Renderer, A4Renderer
from taichi_tracer.sampler import ADAPTIVE_SAMPLER, DEFAULT_SAMPLER
from taichi_tracer.scene_data import SceneData, again
from taichi_tracer.scene_data_loader import load_scene_data
from taichi_tracer.studies.tables import describe_machine
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts import PARTS, load_parts

# ── variants ──


NO_ROULETTE, COURSE, BY_THROUGHPUT = "none", *path_settings.ROULETTES
REFERENCE_LAMPS = "hierarchy"  # of the reference, where choices of lamps are compared: it has the least noise
# Attribute of ``Variant`` → what a value of it is called; values of others are names already.
WORDS: dict[str, Callable[[Any], str]] = {
    "fast_math": lambda is_on: "fast math" if is_on else "no fast math",
    "adaptive": lambda is_on: "adaptive" if is_on else "not adaptive",
    "scale": lambda scale: f"resolution × {scale:g}",
    "intersector": lambda name: name or "the scene's intersector",
    "lamp_choice": lambda name: f"lamps by {name}" if name else "the scene's choice of lamps",
    "max_bounces": lambda n: "1 bounce" if n == 1 else f"{n} bounces",
    "roulette": lambda q: {NO_ROULETTE: "no roulette", BY_THROUGHPUT: "roulette by throughput"}.get(q, f"roulette {q}"),
    "lookup": lambda name: f"{name} look-up",
}


@dataclass(frozen=True)
class Variant:
    """One value of every knob.

    Attributes:
        scale: of the resolution: 0.5 renders half as many pixels along each side.
        intersector, lamp_choice: None is the one that the scene has, or the default of ``SceneData``.
        max_bounces, rr_start_bounce: of paths, as for ``PathSettings``.
        roulette: of paths: "none", "throughput", or the constant q of the course as a number.
    """

    estimator: str = "mis"
    sampler: str = DEFAULT_SAMPLER
    triangle_test: str = "watertight"
    precision: str = "f32"
    fast_math: bool = False
    lookup: str = "nearest"
    adaptive: bool = False
    scale: float = 1.0
    intersector: str | None = None
    lamp_choice: str | None = None
    max_bounces: int = 5
    roulette: str | float = NO_ROULETTE
    rr_start_bounce: int = 3

    def difference(self, base: "Variant") -> str:
        """The name of the knob that has another value than in the first variant; "" for the first variant itself."""
        return next((f.name for f in fields(self) if getattr(self, f.name) != getattr(base, f.name)), "")

    def label(self, base: "Variant") -> str:
        """The estimator, and what differs from the first variant."""
        knob = self.difference(base)
        return self.estimator if knob in ("", "estimator") else f"{self.estimator}, {self.value_in_words(knob)}"

    def value_in_words(self, knob: str) -> str:
        """The value of one knob in words."""
        value = getattr(self, knob)
        return WORDS[knob](value) if knob in WORDS else str(value)

    @property
    def process(self) -> tuple:
        """Variants in which this is equal are rendered by one process: Taichi runs there in one way."""
        return self.precision, self.fast_math

    @property
    def scene(self) -> tuple:
        """Variants in which this is equal share a scene."""
        return self.lookup, self.triangle_test, self.intersector, self.lamp_choice

    @property
    def renderer(self) -> tuple:
        """Variants in which this is equal share a renderer, and with it a film."""
        return *self.scene, is_path(self.estimator), self.sampler, self.adaptive, self.scale

    @property
    def paths(self) -> dict:
        """The arguments of ``PathSettings.set``."""
        return {
            "max_bounces": self.max_bounces,
            "rr_start_bounce": self.rr_start_bounce,
            "roulette": BY_THROUGHPUT if self.roulette == BY_THROUGHPUT else COURSE,
            "rr_termination_probability": 0.0 if isinstance(self.roulette, str) else self.roulette,
        }


PATHS = ("path", "explicit", "implicit")
# What a study compares if nothing is named: the arguments of ``plan``, each with the value of the first variant first.
USUAL: dict[str, tuple] = {
    "estimators": ("mis", "uniform", "brdf", "environment"),
    "samplers": (DEFAULT_SAMPLER, ADAPTIVE_SAMPLER, "independent"),
    "precisions": ("f32", "f64"),
    "triangle_tests": ("watertight", "moller_trumbore"),
    "lookups": ("nearest", "bilinear"),
    "fast_math": (False, True),
    "adaptive": (False, True),
    "scales": (1.0, 0.5),
    "intersectors": (None,),
    "lamp_choices": (None,),
    "max_bounces": (5,),
    "roulettes": (NO_ROULETTE,),
}
NAMED = ("estimators", "samplers", "precisions", "triangle_tests", "lookups", "intersectors", "lamp_choices")
OF_PATHS = ("max_bounces", "roulettes")  # what only paths have
ALL = ("all",)  # estimators: of direct light, or of paths where they are asked about


def known(knob: str) -> tuple[str, ...]:
    """The names that an argument of ``plan`` can hold, those of registered parts among them."""
    if knob == "estimators":
        return tuple(PARTS.last_of("renderer", A2Renderer).names() + A4Renderer.names())
    fixed = {"precisions": runtime.PRECISIONS, "lookups": LOOKUPS, "roulettes": (NO_ROULETTE, BY_THROUGHPUT)}
    return fixed[knob] if knob in fixed else tuple(PARTS.names(kind_of(knob)))


def kind_of(knob: str) -> str:
    """What one value of an argument of ``plan`` is called; that of a part is its kind."""
    return knob.removesuffix("s").replace("_", " ")


def plan(rr_start_bounce: int = 3, **knobs: Sequence | None) -> list[Variant]:
    """The first variant, and each knob turned alone from it.

    Args:
        knobs: the values of each of ``USUAL``, or ``ALL`` that are known; None is not given. If several values of a
            knob are given, only what is given is compared; otherwise what ``USUAL`` has. Roulettes are "none",
            "throughput", or numbers q between 0 and 1. The largest of ``max_bounces`` is that of the first variant,
            and of the reference.

    Raises:
        InputError: an unknown name, a number that is out of its range, or estimators that cannot be compared.
    """
    given = {name: tuple(values) for name, values in knobs.items() if values is not None}
    of_paths = any(name in given for name in OF_PATHS)
    every = {name: known(name) for name, values in given.items() if values == ALL}
    if "estimators" in every:
        every["estimators"] = tuple(name for name in known("estimators") if is_path(name) == of_paths)
    asked = given | every
    usual = USUAL | {"estimators": PATHS} if of_paths else USUAL
    if any(len(values) > 1 for values in asked.values()):
        usual = {name: values[:1] for name, values in usual.items()}
    chosen = usual | asked
    check(chosen, rr_start_bounce, [name for name in OF_PATHS if name in asked])
    chosen["max_bounces"] = tuple(sorted(chosen["max_bounces"], reverse=True))
    values = {knob if knob == "max_bounces" else knob.removesuffix("s"): found for knob, found in chosen.items()}
    first = Variant(**{name: found[0] for name, found in values.items()}, rr_start_bounce=rr_start_bounce)
    others = [replace(first, **{name: value}) for name, found in values.items() for value in found[1:]]
    return list(dict.fromkeys([first, *others]))


def reference_variant(variant: Variant, variants: Sequence[Variant]) -> Variant:
    """What the reference of a variant is rendered with: the package's own parts, whatever is compared with them."""
    choices = {v.lamp_choice for v in variants}
    own = Variant(
        estimator="path" if is_path(variant.estimator) else "mis",
        lamp_choice=variant.lamp_choice if len(choices) == 1 else REFERENCE_LAMPS,
        max_bounces=max(v.max_bounces for v in variants),
    )
    of_scene = ("precision", "fast_math", "lookup", "triangle_test", "intersector")
    return replace(own, **{knob: getattr(variant, knob) for knob in of_scene})


def check(chosen: dict[str, tuple], rr_start_bounce: int, of_paths: list[str]) -> None:
    """Raise an InputError for an unknown name, a number out of its range, or estimators that cannot be compared.

    Args:
        chosen: the arguments of ``plan``. of_paths: those of ``OF_PATHS`` that the user named.
    """
    for knob in NAMED:
        for name in (name for name in chosen[knob] if name is not None):
            if name not in known(knob):
                raise one_of(kind_of(knob), name, known(knob))
    paths = [name for name in chosen["estimators"] if is_path(name)]
    direct = [name for name in chosen["estimators"] if name not in paths]
    if paths and direct:
        raise InputError(
            f"accuracy: light bounces with {', '.join(paths)}, and not with {', '.join(direct)}: these pictures have "
            "different means, so that no reference fits both: compare one kind at a time"
        )
    if of_paths and direct:
        raise InputError(
            f"accuracy: {of_paths[0]} is of paths, and light does not bounce with {', '.join(direct)}: "
            f"use estimators among {', '.join(A4Renderer.names())}"
        )
    for roulette in chosen["roulettes"]:
        if isinstance(roulette, str) and roulette not in known("roulettes"):
            raise one_of("roulette", roulette, (*known("roulettes"), "or a number q with 0 < q < 1"))
        if not isinstance(roulette, str) and not 0 < roulette < 1:
            raise InputError(f"roulettes: q must be more than 0 and less than 1, not {roulette!r}")
    for bounces in chosen["max_bounces"]:
        path_settings.check(bounces, rr_start_bounce, 0.0, COURSE, None)


def is_path(estimator: str) -> bool:
    """Whether light bounces with an estimator."""
    return estimator in A4Renderer.names()


def renderer_of(estimator: str) -> type[ProgressiveRenderer]:
    """The renderer that offers an estimator, of direct light or of paths."""
    return A4Renderer if is_path(estimator) else PARTS.last_of("renderer", A2Renderer)


# ── scenes ──


LIGHT = "studio"  # what lights a scene that has no light of its own
NO_LIGHT = "none"  # the name for no environment, as on the command line


class SceneFacts(NamedTuple):
    """What a study must know of a scene.

    Attributes:
        read_seconds: of reading the scene, and of building its hierarchy.
    """

    title: str
    machine: str
    lamps: int
    has_environment: bool
    read_seconds: float


def unpacked(environment: Environment, options: dict) -> tuple[np.ndarray, dict]:
    """The pixels of an environment, and its options, unless others are given."""
    own = {name: getattr(environment, name) for name in ("intensity", "rotation", "name")}
    return environment.pixels, own | options


# ── rendering ──


JUDGED = 2.0  # times the error of the reference: smaller errors cannot be measured


class Shot(NamedTuple):
    """A picture in the making, or a reference.

    Attributes:
        seconds: of the samples that were just added. samples: per pixel, all of this seed.
        error: the estimate of the picture itself. variance: (h, w, 3) of the mean of every pixel.
    """

    seconds: float
    samples: int
    image: np.ndarray
    error: RelativeError
    variance: np.ndarray

    @property
    def least_error(self) -> float:
        """Smaller errors cannot be separated from that of this reference."""
        return JUDGED * float(self.error)

    def error_of(self, image: np.ndarray) -> float:
        """The relative RMSE of a picture, beyond that of this reference; NaN where it is too small to measure."""
        measured = relative_rmse(image, self.image)
        return math.sqrt(measured**2 - float(self.error) ** 2) if measured > self.least_error else math.nan

    def scaled(self, scale: float) -> "Shot":
        """The reference for a picture of fewer pixels: the means of blocks of its pixels."""
        if scale == 1:
            return self
        n = round(1 / scale)
        image, variance = blocks_of(self.image, n), blocks_of(self.variance / n**2, n)
        factor = math.sqrt(variance.mean() / self.variance.mean()) if self.variance.mean() > 0 else 1.0
        error = RelativeError(self.error * factor, self.error.low * factor, self.error.high * factor)
        return self._replace(image=image, error=error, variance=variance)


class Bench:
    """Reads a scene for every variant, and renders it. Every process of a study has a copy of its own.

    Args:
        scene: a name, a path, or a ``SceneData``; that one cannot be compared in another precision or with fast math,
            since both would start Taichi anew and end it.
        environment: what lights it, or "none"; None takes the scene's own light, or ``LIGHT`` if it has none.
        size: width and height. arch: as for ``runtime.init``. parts: files that register parts of the user.
        of_scene: further options of ``load_scene_data``, for a scene that is given by name.
        view_of: the parameters of the camera, from those of the scene; None leaves them.
        here: whether the scene is rendered in the process of the caller, whose Taichi stays as it is; a scene that is
            there always is.
        options: of the environment: intensity, rotation.
    """

    def __init__(
        self,
        scene,
        environment=None,
        size: tuple[int, int] = (128, 128),
        arch: str = "auto",
        parts: tuple[str, ...] = (),
        of_scene: Mapping[str, Any] | None = None,
        view_of: Callable[[dict], dict] | None = None,
        here: bool = False,
        **options,
    ) -> None:
        self.here = here or isinstance(scene, SceneData)
        if isinstance(environment, Environment) and not self.here:  # its fields stay in the process of the caller
            environment, options = unpacked(environment, options)
        self.scene, self.environment, self.options, self.view_of = scene, environment, options, view_of
        self.size, self.arch, self.parts, self.of_scene = size, arch, parts, of_scene or {}
        self.scenes: dict[tuple, SceneData] = {}
        self.renderers: dict[tuple, ProgressiveRenderer] = {}

    def check(self, variants: Sequence[Variant]) -> None:
        """Raise InputError where a variant needs Taichi to be started anew, and with it the caller's scene to end."""
        settings = runtime.ensure() if self.here else None
        if self.here and any((v.precision, v.fast_math) != (settings.precision, settings.fast_math) for v in variants):
            raise InputError(
                "accuracy: precision and fast math cannot change for a loaded scene, nor for parts that only this "
                "process has: give the name or path of the scene, and parts by --parts"
            )

    def facts(self, variant: Variant) -> SceneFacts:
        """Read the scene of a variant, and describe it.

        Raises:
            InputError: it has no light.
        """
        self.start(variant)
        start = time.perf_counter()
        scene = self.scene_of(variant)
        return SceneFacts(
            title=self.title(scene),
            machine=describe_machine(),
            lamps=scene.lamps.count,
            has_environment=scene.environment is not None,
            read_seconds=time.perf_counter() - start,
        )

    def title(self, scene: SceneData) -> str:
        """What is rendered, for titles: the scene and its light."""
        name = Path(str(getattr(self.scene, "source", self.scene))).stem
        lamps = "lit by its lamps" if scene.lamps.count > 0 else ""
        sky = "" if scene.environment is None else f"under {scene.environment.name}"
        return ", ".join(part for part in (f"{name} {sky}".strip(), lamps) if part)

    def start(self, variant: Variant) -> None:
        """Start Taichi in the precision of a variant, once."""
        if not self.scenes and not self.here:
            runtime.init(self.arch, variant.precision, variant.fast_math, force=True)

    def load(self, variant: Variant) -> SceneData:
        """The scene as a variant wants it, in the running precision.

        Raises:
            InputError: it has no light.
        """
        names = "triangle_test", "intersector", "lamp_choice"
        parts = {name: getattr(variant, name) for name in names if getattr(variant, name) is not None}
        is_loaded = isinstance(self.scene, SceneData)
        scene = again(self.scene, **parts) if is_loaded else load_scene_data(self.scene, **parts, **self.of_scene)
        light = scene.environment if self.environment is None else self.environment
        if light is None and not scene.effects.is_lit:
            light = LIGHT
        options = self.options
        if isinstance(light, Environment):
            light, options = unpacked(light, options)
        is_none = light is None or (isinstance(light, str) and light == NO_LIGHT)
        scene.set_environment(None if is_none else load_environment(light, lookup=variant.lookup, **options))
        if not scene.effects.is_lit:
            raise InputError(f"accuracy: {scene.source} has no light: give an environment, such as {LIGHT}")
        if self.view_of is not None:
            scene.view = self.view_of(scene.view)
        return scene

    def scene_of(self, variant: Variant) -> SceneData:
        """The scene of a variant, loaded once."""
        self.start(variant)
        if variant.scene not in self.scenes:
            self.scenes[variant.scene] = self.load(variant)
        return self.scenes[variant.scene]

    def prepare(self, variant: Variant) -> float:
        """Compile a variant, or load what an earlier run compiled: the seconds."""
        start = time.perf_counter()
        self.render(variant, 1, seed=0)
        return time.perf_counter() - start

    def render(self, variant: Variant, samples: int, seed: int | None = None) -> Shot:
        """Add samples to the picture of a variant; with a seed, to a new picture with these random numbers."""
        renderer = self.renderer_of(variant)
        if seed is not None:
            renderer.seed = seed
            if isinstance(renderer, A4Renderer):
                renderer.path_settings.set(**variant.paths)
            renderer.use(variant.estimator).begin_anew()
        start = time.perf_counter()
        renderer.render(samples)
        ti.sync()
        seconds, film = time.perf_counter() - start, renderer.film
        variance = np.nan_to_num(film.variance_of_mean()).astype(np.float32)
        return Shot(seconds, renderer.samples, film.image().astype(np.float32), renderer.error(), variance)

    def renderer_of(self, variant: Variant) -> ProgressiveRenderer:
        """The renderer of a variant; one for all estimators of a kind."""
        width, height = (max(1, int(variant.scale * n)) for n in self.size)
        if variant.renderer not in self.renderers:
            make, options = renderer_of(variant.estimator), {"sampler": variant.sampler, "adaptive": variant.adaptive}
            self.renderers[variant.renderer] = make(self.scene_of(variant), width, height, **options)
        return self.renderers[variant.renderer]


_bench: Bench | None = None  # of this process


def begin(bench: Bench) -> None:
    """Make this the bench of this process. A process leaves Ctrl-C to its parent, which then writes what is done."""
    global _bench
    if not bench.here:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    for path in bench.parts:
        load_parts(path)
    _bench = bench


def answer(method: str, words: tuple[Any, ...]) -> Any:
    """Call a method of the bench of this process."""
    return getattr(_bench, method)(*words)


class Worker:
    """A ``Bench`` in a process of its own, or in a thread, for scenes and parts that no other process has."""

    def __init__(self, bench: Bench) -> None:
        main = sys.modules["__main__"]
        known = {name: vars(main).get(name) for name in ("__spec__", "__file__")}
        self.pool: Executor = ThreadPoolExecutor(1, initializer=begin, initargs=(bench,))
        if not bench.here:
            self.pool = ProcessPoolExecutor(1, get_context("spawn"), begin, (bench,))
        vars(main).update(dict.fromkeys(known))  # the process does not run the program of the user once more
        self.ready = self.pool.submit(int)  # starts it
        vars(main).update(known)

    def ask(self, method: str, *words: Any) -> Future:
        """Call a method of the bench, after those that were asked for before."""
        return self.pool.submit(answer, method, words)

    def close(self) -> None:
        """End the process, with what it does now; a thread ends after it."""
        self.pool.shutdown(wait=False, cancel_futures=True)
        for child in active_children():
            child.terminate()
