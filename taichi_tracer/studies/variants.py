"""The ways to render one picture that a study of accuracy compares, and the scenes they need."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from taichi_tracer.assignments import A2Renderer, A4Renderer
from taichi_tracer.environment import LOOKUPS, Environment, load_environment
from taichi_tracer.integrators import path_settings
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.sampler import DEFAULT_SAMPLER
from taichi_tracer.scene_data import SceneData, again
from taichi_tracer.scene_data_loader import load_scene_data
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS
from taichi_tracer.system.seams import assigned

LIGHT = "studio"  # what lights a scene that has no light of its own
NO_LIGHT = "none"  # the name for no environment, as on the command line
NO_ROULETTE, COURSE, BY_THROUGHPUT = "none", *path_settings.ROULETTES
MAX_BOUNCES, RR_START = 5, 3  # the defaults of ``PathSettings``
MOST_FOR_PLAIN = 100_000  # primitives: the plain hierarchy is built in Python, which takes about 20 s for so many
REFERENCE_LAMPS = "hierarchy"  # of the reference, where choices of lamps are compared: it has the least noise


@dataclass(frozen=True)
class Variant:
    """One setting of every knob.

    Attributes:
        scale: of the resolution: 0.5 renders half as many pixels along each side.
        intersector, lamp_choice: None is the one that the scene has, or the default of ``SceneData``.
        plain: whether only the plain forms run, which have the same bits and take longer.
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
    plain: bool = False
    lamp_choice: str | None = None
    max_bounces: int = MAX_BOUNCES
    roulette: str | float = NO_ROULETTE
    rr_start_bounce: int = RR_START

    def differences(self, other: "Variant") -> list[str]:
        """The names of the knobs that are set otherwise."""
        return [f.name for f in fields(self) if getattr(self, f.name) != getattr(other, f.name)]

    @property
    def label(self) -> str:
        """Estimator, sampler, the bounces of paths, and what differs from the defaults."""
        usual = Variant(self.estimator, self.sampler, max_bounces=self.max_bounces)
        bounces = [self.setting("max_bounces")] * self.is_path
        if self.roulette == NO_ROULETTE:
            usual = replace(usual, rr_start_bounce=self.rr_start_bounce)
        others = [self.setting(name) for name in self.differences(usual)]
        return ", ".join([self.estimator, self.sampler, *bounces, *others])

    def setting(self, knob: str) -> str:
        """One knob in words."""
        value = getattr(self, knob)
        if knob == "plain":
            return "plain forms" if value else "fast forms"
        if knob == "intersector":
            return "the scene's own intersector" if value is None else value
        if knob == "lamp_choice":
            return "the scene's own choice of lamps" if value is None else f"lamps by {value}"
        if knob == "max_bounces":
            return f"{value} bounce" if value == 1 else f"{value} bounces"
        if knob == "roulette":
            named = {NO_ROULETTE: "no roulette", BY_THROUGHPUT: "roulette by throughput"}
            return named.get(value) or f"roulette q = {value}"
        if knob == "rr_start_bounce":
            return f"after bounce {value}"
        words = {"fast_math": "fast math", "adaptive": "adaptive", "scale": f"resolution x {self.scale:g}"}
        return words.get(knob, str(value)) if value is not False else f"no {words[knob]}"

    @property
    def scene(self) -> tuple:
        """The knobs that belong to the scene: variants in which they are equal share one."""
        return self.lookup, self.triangle_test, self.intersector, self.plain, self.lamp_choice

    @property
    def is_path(self) -> bool:
        """Whether light bounces."""
        return is_path(self.estimator)

    @property
    def paths(self) -> dict:
        """The arguments of ``PathSettings.set``."""
        values = {"max_bounces": self.max_bounces, "rr_start_bounce": self.rr_start_bounce}
        if self.roulette in (NO_ROULETTE, BY_THROUGHPUT):
            named = COURSE if self.roulette == NO_ROULETTE else BY_THROUGHPUT
            return values | {"roulette": named, "rr_termination_probability": 0.0}
        return values | {"roulette": COURSE, "rr_termination_probability": self.roulette}


FORMS = ("fast", "plain")
DIRECT, PATHS = ("uniform", "brdf", "environment", "mis"), ("implicit", "explicit", "path")
# What a study compares if nothing is named.
USUAL: dict[str, tuple] = {
    "estimators": DIRECT,
    "samplers": (DEFAULT_SAMPLER, "niederreiter_one", "independent"),
    "precisions": ("f32", "f64"),
    "triangle_tests": ("watertight", "moller_trumbore"),
    "fast_math": (False, True),
    "lookups": ("nearest", "bilinear"),
    "adaptive": (False, True),
    "scales": (1.0, 0.5),
    "intersectors": (None,),
    "forms": ("fast", "plain"),
    "lamp_choices": (None,),
    "max_bounces": (MAX_BOUNCES,),
    "roulettes": (NO_ROULETTE,),
}
NAMED = ("estimators", "samplers", "precisions", "triangle_tests", "lookups", "intersectors", "forms", "lamp_choices")
OF_PATHS = ("max_bounces", "roulettes")  # what only paths have
QUESTIONS = ("lamp_choices", *OF_PATHS)  # whoever asks one of these wants its answer alone


def known(knob: str) -> tuple[str, ...]:
    """The names that a parameter of ``plan`` can hold, those of registered parts among them."""
    kinds = {"samplers": "sampler", "triangle_tests": "triangle test", "intersectors": "intersector"}
    kinds |= {"lamp_choices": "lamp choice"}
    if knob in kinds:
        return tuple(PARTS.names(kinds[knob]))
    if knob == "estimators":
        return tuple(light_renderer().names() + A4Renderer.names())
    if knob == "roulettes":
        return NO_ROULETTE, BY_THROUGHPUT
    return {"precisions": runtime.PRECISIONS, "lookups": LOOKUPS, "forms": FORMS}[knob]


def plan(
    estimators: Sequence[str] | None = None,
    samplers: Sequence[str] | None = None,
    precisions: Sequence[str] | None = None,
    triangle_tests: Sequence[str] | None = None,
    fast_math: Sequence[bool] | None = None,
    lookups: Sequence[str] | None = None,
    adaptive: Sequence[bool] | None = None,
    scales: Sequence[float] | None = None,
    intersectors: Sequence[str] | None = None,
    forms: Sequence[str] | None = None,
    lamp_choices: Sequence[str] | None = None,
    max_bounces: Sequence[int] | None = None,
    roulettes: Sequence[str | float] | None = None,
    rr_start_bounce: int = RR_START,
    every: bool = False,
) -> list[Variant]:
    """Every estimator with every sampler, and each other knob turned alone, from the last estimator and first sampler.

    These two are those of the first variant.

    What is None is ``USUAL``. If one of ``QUESTIONS`` has several values, everything that is None keeps one value
    instead, so that the budget is spent on this question. If one of ``OF_PATHS`` is given, estimators of paths are
    compared.

    Args:
        max_bounces: the largest of them is that of all variants that turn another knob, and of the reference.
        roulettes: "none", "throughput", or numbers q between 0 and 1.
        every: every combination of all knobs instead.

    Raises:
        InputError: an unknown name, a number that is out of its range, or estimators that cannot be compared.
    """
    asked = {name: tuple(values) for name, values in locals().items() if name in USUAL and values is not None}
    chosen = usual(asked) | asked
    check(chosen, rr_start_bounce, [name for name in OF_PATHS if name in asked])
    values = {
        "estimator": chosen["estimators"],
        "sampler": chosen["samplers"],
        "precision": chosen["precisions"],
        "triangle_test": chosen["triangle_tests"],
        "lookup": chosen["lookups"],
        "fast_math": chosen["fast_math"],
        "adaptive": chosen["adaptive"],
        "scale": chosen["scales"],
        "intersector": chosen["intersectors"],
        "plain": tuple(form == "plain" for form in chosen["forms"]),
        "lamp_choice": chosen["lamp_choices"],
        "max_bounces": tuple(sorted(set(chosen["max_bounces"]), reverse=True)),
        "roulette": chosen["roulettes"],
    }
    first = {knob: settings[0] for knob, settings in values.items()} | {"rr_start_bounce": rr_start_bounce}
    last = values["estimator"][-1]
    estimators = [last, *(e for e in values["estimator"] if e != last)]
    both = [(e, s) for e in estimators for s in values["sampler"]]
    variants = [Variant(**first | {"estimator": e, "sampler": s}) for e, s in both]
    others = [knob for knob in values if knob not in ("estimator", "sampler")]
    if every and "forms" not in asked:  # they change no picture, and would double everything
        values["plain"] = values["plain"][:1]
    for knob in others:
        from_these = list(variants) if every else variants[:1]
        variants += [replace(v, **{knob: value}) for v in from_these for value in values[knob][1:]]
    return variants


def of_questions() -> tuple[str, ...]:
    """The attributes of ``Variant`` that belong to ``QUESTIONS``."""
    return "lamp_choice", "max_bounces", "roulette"


def comparable(
    variants: list[Variant], lamps: int, has_environment: bool, source: str
) -> tuple[list[Variant], list[str]]:
    """The variants that differ in a scene, and notes on those that do not.

    Args:
        lamps: how many the scene has. source: its name, for an error.

    Raises:
        InputError: choices of lamps are compared, and the scene has no lamps.
    """
    if len({v.lamp_choice for v in variants}) > 1 and lamps == 0:
        raise InputError(f"accuracy: {source} has no surface with Ke > 0, so that no lamp is chosen")
    notes = []
    if not has_environment and len({v.lookup for v in variants}) > 1:
        variants = [v for v in variants if v.lookup == variants[0].lookup]
        notes.append("The scene has no environment, so that its look-up was not compared.")
    return variants, notes


def reference_variant(variant: Variant, variants: list[Variant]) -> Variant:
    """What the reference of a variant is rendered with: the package's own parts, whatever is compared with them."""
    choices = {v.lamp_choice for v in variants}
    own = Variant(
        estimator="path" if variant.is_path else "mis",
        lamp_choice=variant.lamp_choice if len(choices) == 1 else REFERENCE_LAMPS,
        max_bounces=max(v.max_bounces for v in variants),
    )
    of_scene = ("precision", "fast_math", "lookup", "triangle_test", "intersector", "plain")
    return replace(own, **{knob: getattr(variant, knob) for knob in of_scene})


def usual(asked: dict[str, tuple]) -> dict[str, tuple]:
    """The parameters of ``plan`` if nothing is named but ``asked``."""
    asks_one = any(len(asked.get(name, ())) > 1 for name in QUESTIONS)
    is_of_paths = any(name in asked for name in OF_PATHS)
    if asks_one:
        one = {name: values[:1] for name, values in USUAL.items()}
        return one | {"estimators": PATHS[-1:] if is_of_paths else DIRECT[-1:]}
    return USUAL | {"estimators": PATHS if is_of_paths else DIRECT}


def check(chosen: dict[str, tuple], rr_start_bounce: int, of_paths: list[str]) -> None:
    """Raise an InputError for an unknown name, a number out of its range, or estimators that cannot be compared.

    Args:
        chosen: the parameters of ``plan``. of_paths: those of ``OF_PATHS`` that the user named.
    """
    for knob in NAMED:
        for name in (name for name in chosen[knob] if name is not None):
            if name not in known(knob):
                raise one_of(knob.removesuffix("s").replace("_", " "), name, known(knob))
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


def lives_here_alone(parts: Sequence[str] = ()) -> bool:
    """Whether this process has parts of its user that another process would not find.

    Args:
        parts: files that another process would load.
    """
    files = {str(Path(path).expanduser().resolve()) for path in parts}
    known = [part for path in files for part in PARTS.registered_by(path)]
    own = [part for part in PARTS.everything() if not PARTS.comes_with_package(part)]
    return any(not any(part is other for other in known) for part in own) or (bool(assigned()) and not files)


def is_path(estimator: str) -> bool:
    """Whether light bounces with an estimator."""
    return estimator in A4Renderer.names()


def renderer_of(estimator: str) -> type[ProgressiveRenderer]:
    """The renderer that offers an estimator, of direct light or of paths."""
    return A4Renderer if is_path(estimator) else light_renderer()


def light_renderer() -> type[A2Renderer]:
    """The renderer that offers estimators; of several, the one that was registered last."""
    return [c for c in PARTS.all("renderer") if issubclass(c, A2Renderer)][-1]


class Source:
    """Where a study's scenes come from: a name or a path, read again for every setting, or a scene that is there.

    Args:
        scene: a name, a path, or a ``SceneData``; that one cannot be compared in another precision or with fast math,
            since both would start Taichi anew and end it.
        environment: what lights it, or "none"; None takes the scene's own light, or ``LIGHT`` if it has none.
        brdfs, lights, two_sided_lamps: as for ``SceneData``, of a scene that is given by name.
        view_of: the parameters of the camera, from those of the scene; None leaves them.
        up_axis: as for ``SceneData``, of a scene that is given by name.
        here: whether the scene is rendered in the process of the caller, whose Taichi stays as it is; a scene that is
            there always is.
        options: of the environment: intensity, rotation.
    """

    def __init__(
        self,
        scene,
        environment=None,
        brdfs=(),
        lights=(),
        view_of: Callable[[dict], dict] | None = None,
        up_axis: str = "y",
        two_sided_lamps: bool = False,
        here: bool = False,
        **options,
    ) -> None:
        self.here = here or isinstance(scene, SceneData)
        if isinstance(environment, Environment) and not self.here:  # its fields stay in the process of the caller
            own = {name: getattr(environment, name) for name in ("intensity", "rotation", "name")}
            environment, options = environment.pixels, own | options
        self.scene, self.environment, self.options, self.view_of = scene, environment, options, view_of
        self.of_scene = {"brdfs": brdfs, "lights": lights, "up_axis": up_axis, "two_sided_lamps": two_sided_lamps}

    @property
    def is_loaded(self) -> bool:
        """Whether the scene is the caller's."""
        return isinstance(self.scene, SceneData)

    def title(self, scene: SceneData) -> str:
        """What is rendered, for titles: the scene and its light."""
        name = Path(scene.source).stem if self.is_loaded else Path(str(self.scene)).stem
        lamps = "lit by its lamps" if scene.lamps.count > 0 else ""
        sky = "" if scene.environment is None else f"under {scene.environment.name}"
        return ", ".join(part for part in (f"{name} {sky}".strip(), lamps) if part)

    def check(self, variants: list[Variant]) -> None:
        """Raise InputError where a variant needs Taichi to be started anew, and with it the caller's scene to end."""
        settings = runtime.ensure() if self.here else None
        for variant in variants if self.here else ():
            if (settings.precision, settings.fast_math) != (variant.precision, variant.fast_math):
                what = "a loaded scene" if self.is_loaded else "a scene with parts that only this process has"
                advice = "give its name or path instead" if self.is_loaded else "give these parts by --parts"
                raise InputError(f"accuracy: precision and fast math of {what} cannot change: {advice}")

    def start(self, variant: Variant, arch: str = "auto", threads: int | None = None) -> None:
        """Bring Taichi into the precision of a variant."""
        if not self.here:
            runtime.init(arch, variant.precision, variant.fast_math, force=True, threads=threads)

    def load(self, variant: Variant) -> SceneData:
        """The scene as a variant wants it, in the running precision.

        Raises:
            InputError: it has no light.
        """
        options = {"triangle_test": variant.triangle_test}
        options |= {k: getattr(variant, k) for k in ("intersector", "lamp_choice") if getattr(variant, k) is not None}
        if self.is_loaded:
            scene = again(self.scene, **options, fast=self.scene.fast and not variant.plain)
        else:
            scene = load_scene_data(self.scene, **options, **self.of_scene, fast=not variant.plain)
        light = scene.environment if self.environment is None else self.environment
        if light is None and scene.effects.is_dark:
            light = LIGHT
        scene.set_environment(self.load_environment(light, variant))
        if scene.effects.is_dark:
            raise InputError(f"accuracy: {scene.source} has no light: give an environment, such as {LIGHT}")
        if self.view_of is not None:
            scene.view = self.view_of(scene.view)
        return scene

    def load_environment(self, environment, variant: Variant) -> Environment | None:
        """A light from far away, with the look-up that a variant wants; None for none."""
        options = dict(self.options)
        if environment is None or (isinstance(environment, str) and environment == NO_LIGHT):
            return None
        if isinstance(environment, Environment):
            own = {name: getattr(environment, name) for name in ("intensity", "rotation", "name")}
            environment, options = environment.pixels, own | options
        return load_environment(environment, lookup=variant.lookup, **options)
