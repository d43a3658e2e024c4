"""The ways to render one picture that a study of accuracy compares, and the scenes they need."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path

from taichi_tracer.environment import LOOKUPS, Environment, load_environment
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.scene_data import SceneData, again
from taichi_tracer.scene_data_loader import load_scene_data
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS

LIGHT = "studio"  # what lights a scene that has no environment of its own


@dataclass(frozen=True)
class Variant:
    """One setting of every knob.

    Attributes:
        scale: of the resolution: 0.5 renders half as many pixels along each side.
        intersector: None is the one that the scene has, or the default of ``SceneData``.
        plain: whether only the plain forms run, which have the same bits and take longer.
    """

    estimator: str = "mis"
    sampler: str = "sobol"
    triangle_test: str = "watertight"
    precision: str = "f32"
    fast_math: bool = False
    lookup: str = "nearest"
    adaptive: bool = False
    scale: float = 1.0
    intersector: str | None = None
    plain: bool = False

    def differences(self, other: "Variant") -> list[str]:
        """The names of the knobs that are set otherwise."""
        return [f.name for f in fields(self) if getattr(self, f.name) != getattr(other, f.name)]

    @property
    def label(self) -> str:
        """Estimator, sampler, and what differs from the defaults."""
        usual = Variant(self.estimator, self.sampler)
        return ", ".join([self.estimator, self.sampler, *(self.setting(name) for name in self.differences(usual))])

    def setting(self, knob: str) -> str:
        """One knob in words."""
        value = getattr(self, knob)
        if knob == "plain":
            return "plain forms" if value else "fast forms"
        if knob == "intersector":
            return "the scene's own intersector" if value is None else value
        words = {"fast_math": "fast math", "adaptive": "adaptive", "scale": f"resolution x {self.scale:g}"}
        return words.get(knob, str(value)) if value is not False else f"no {words[knob]}"

    @property
    def scene(self) -> tuple:
        """The knobs that belong to the scene: variants in which they are equal share one."""
        return self.lookup, self.triangle_test, self.intersector, self.plain


FORMS = ("fast", "plain")


def known(knob: str) -> tuple[str, ...]:
    """The names that a parameter of ``plan`` can hold, those of registered parts among them."""
    kinds = {"samplers": "sampler", "triangle_tests": "triangle test", "intersectors": "intersector"}
    if knob in kinds:
        return tuple(PARTS.names(kinds[knob]))
    if knob == "estimators":
        return tuple(A2Renderer.names())
    return {"precisions": runtime.PRECISIONS, "lookups": LOOKUPS, "forms": FORMS}[knob]


def plan(
    estimators: tuple[str, ...] = ("uniform", "brdf", "environment", "mis"),
    samplers: tuple[str, ...] = ("sobol", "independent"),
    precisions: tuple[str, ...] = ("f32", "f64"),
    triangle_tests: tuple[str, ...] = ("watertight", "moller_trumbore"),
    fast_math: tuple[bool, ...] = (False, True),
    lookups: tuple[str, ...] = ("nearest", "bilinear"),
    adaptive: tuple[bool, ...] = (False, True),
    scales: tuple[float, ...] = (1.0, 0.5),
    intersectors: tuple[str, ...] = (),
    forms: tuple[str, ...] = ("fast",),
    every: bool = False,
) -> list[Variant]:
    """Every estimator with every sampler, and each other knob turned alone, from the last estimator and first sampler.

    Args:
        intersectors: none is the one of the scene.
        forms: "plain" is not among the defaults: its pictures are the same to the last bit, so that a study of errors
            would spend seconds of its budget on a ratio of times alone, and on a large mesh minutes, since the plain
            hierarchy is built in Python. ``taichi-tracer effects`` tells that ratio too.
        every: every combination of all knobs instead.

    Raises:
        InputError: an unknown name.
    """
    named = {"estimators": estimators, "samplers": samplers, "precisions": precisions, "lookups": lookups}
    named |= {"triangle_tests": triangle_tests, "intersectors": intersectors, "forms": forms}
    for knob, names in named.items():
        for name in names:
            if name not in known(knob):
                raise one_of(knob.removesuffix("s").replace("_", " "), name, known(knob))
    values = {
        "estimator": estimators,
        "sampler": samplers,
        "precision": precisions,
        "triangle_test": triangle_tests,
        "lookup": lookups,
        "fast_math": fast_math,
        "adaptive": adaptive,
        "scale": scales,
        "intersector": intersectors or (None,),
        "plain": tuple(form == "plain" for form in forms),
    }
    first = {knob: settings[0] for knob, settings in values.items()}
    variants = [Variant(**first | {"estimator": e, "sampler": s}) for e in estimators for s in samplers]
    others = [knob for knob in values if knob not in ("estimator", "sampler")]
    for knob in others:
        from_these = list(variants) if every else [Variant(**first | {"estimator": estimators[-1]})]
        variants += [replace(v, **{knob: value}) for v in from_these for value in values[knob][1:]]
    return variants


def light_renderer() -> type[A2Renderer]:
    """The renderer that offers estimators; of several, the one that was registered last."""
    return [c for c in PARTS.all("renderer") if issubclass(c, A2Renderer)][-1]


class Source:
    """Where a study's scenes come from: a name or a path, read again for every setting, or a scene that is there.

    Args:
        scene: a name, a path, or a ``SceneData``; that one cannot be compared in another precision or with fast math,
            since both would start Taichi anew and end it.
        environment: what lights it; None takes the scene's own, or ``LIGHT``.
        brdfs, lights: as for ``SceneData``, of a scene that is given by name.
        view_of: the parameters of the camera, from those of the scene; None leaves them.
        up_axis: as for ``SceneData``, of a scene that is given by name.
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
        **options,
    ) -> None:
        self.scene, self.brdfs, self.lights, self.options = scene, brdfs, lights, options
        self.view_of, self.up_axis = view_of, up_axis
        own = scene.environment if isinstance(scene, SceneData) else None
        self.environment = environment if environment is not None else (own if own is not None else LIGHT)

    @property
    def is_loaded(self) -> bool:
        """Whether the scene is the caller's, and Taichi must not be started anew."""
        return isinstance(self.scene, SceneData)

    @property
    def name(self) -> str:
        """For titles."""
        name = Path(self.scene.source).stem if self.is_loaded else Path(str(self.scene)).stem
        return f"{name} under {getattr(self.environment, 'name', self.environment)}"

    def check(self, variants: list[Variant]) -> None:
        """Raise InputError where a variant needs Taichi to be started anew, and with it the caller's scene to end."""
        settings = runtime.current()
        for variant in variants if self.is_loaded else ():
            if (settings.precision, settings.fast_math) != (variant.precision, variant.fast_math):
                raise InputError(
                    "accuracy: precision and fast math of a loaded scene cannot change: give its name or path instead"
                )

    def start(self, variant: Variant, arch: str = "auto") -> None:
        """Bring Taichi into the precision of a variant."""
        if not self.is_loaded:
            runtime.init(arch, variant.precision, variant.fast_math, force=True)

    def load(self, variant: Variant) -> SceneData:
        """The scene as a variant wants it, in the running precision."""
        options = {"triangle_test": variant.triangle_test, "environment": self.load_environment(variant)}
        if variant.intersector is not None:
            options["intersector"] = variant.intersector
        if self.is_loaded:
            scene = again(self.scene, **options, fast=self.scene.fast and not variant.plain)
        else:
            options |= {"brdfs": self.brdfs, "lights": self.lights, "fast": not variant.plain, "up_axis": self.up_axis}
            scene = load_scene_data(self.scene, **options)
        if self.view_of is not None:
            scene.view = self.view_of(scene.view)
        return scene

    def load_environment(self, variant: Variant) -> Environment:
        """The light, with the look-up that a variant wants."""
        environment, options = self.environment, dict(self.options)
        if isinstance(environment, Environment):
            options = {"intensity": environment.intensity, "rotation": environment.rotation, "name": environment.name}
            environment = environment.pixels
        return load_environment(environment, lookup=variant.lookup, **options)
