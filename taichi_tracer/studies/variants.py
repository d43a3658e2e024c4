"""The ways to render one picture that a study of accuracy compares, and the scenes they need."""

from dataclasses import dataclass, fields, replace
from pathlib import Path

from taichi_tracer.environment import LOOKUPS, Environment, load_environment
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import load_scene_data
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.registry import PARTS


@dataclass(frozen=True)
class Variant:
    """One setting of every knob.

    Attributes:
        scale: of the resolution: 0.5 renders half as many pixels along each side.
    """

    estimator: str = "mis"
    sampler: str = "sobol"
    triangle_test: str = "watertight"
    precision: str = "f32"
    fast_math: bool = False
    lookup: str = "nearest"
    adaptive: bool = False
    scale: float = 1.0

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
        words = {"fast_math": "fast math", "adaptive": "adaptive", "scale": f"resolution x {self.scale:g}"}
        return words.get(knob, str(value)) if value is not False else f"no {words[knob]}"


def known(knob: str) -> tuple[str, ...]:
    """The names that a knob can be set to, those of registered parts among them."""
    registered = {"sampler": "sampler", "triangle_test": "triangle test", "intersector": "intersector"}
    if knob == "estimator":
        return tuple(A2Renderer.names())
    if knob in registered:
        return tuple(PARTS.names(registered[knob]))
    return {"precision": ("f32", "f64"), "lookup": LOOKUPS}[knob]


def plan(
    estimators: tuple[str, ...] = ("uniform", "brdf", "environment", "mis"),
    samplers: tuple[str, ...] = ("sobol", "independent"),
    precisions: tuple[str, ...] = ("f32", "f64"),
    triangle_tests: tuple[str, ...] = ("watertight", "moller_trumbore"),
    fast_math: tuple[bool, ...] = (False, True),
    lookups: tuple[str, ...] = ("nearest", "bilinear"),
    adaptive: tuple[bool, ...] = (False, True),
    scales: tuple[float, ...] = (1.0, 0.5),
    every: bool = False,
) -> list[Variant]:
    """Every estimator with every sampler, and each other knob turned alone, from the last estimator and first sampler.

    Args:
        every: every combination of all knobs instead.

    Raises:
        InputError: an unknown name.
    """
    given = {"estimator": estimators, "sampler": samplers, "precision": precisions, "triangle_test": triangle_tests}
    given |= {"lookup": lookups}
    for knob, names in given.items():
        for name in names:
            if name not in known(knob):
                raise one_of(knob.replace("_", " "), name, known(knob))
    given |= {"fast_math": fast_math, "adaptive": adaptive, "scale": scales}
    first = {knob: values[0] for knob, values in given.items()}
    variants = [Variant(**first | {"estimator": e, "sampler": s}) for e in estimators for s in samplers]
    others = [knob for knob in given if knob not in ("estimator", "sampler")]
    for knob in others:
        from_these = list(variants) if every else [Variant(**first | {"estimator": estimators[-1]})]
        variants += [replace(v, **{knob: value}) for v in from_these for value in given[knob][1:]]
    return variants


class Source:
    """Where a study's scenes come from: a name or a path, read again for every setting, or a scene that is there.

    Args:
        scene: a name, a path, or a ``SceneData``; that one cannot be compared in another precision or with fast math,
            since both would start Taichi anew and end it.
        environment: what lights it; None takes the scene's own, or the studio.
        options: of the environment: intensity, rotation.
    """

    def __init__(self, scene, environment=None, **options) -> None:
        self.scene, self.options = scene, options
        own = scene.environment if isinstance(scene, SceneData) else None
        self.environment = environment if environment is not None else (own if own is not None else "studio")

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
        environment, options = self.environment, dict(self.options)
        if isinstance(environment, Environment):
            options = {"intensity": environment.intensity, "rotation": environment.rotation, "name": environment.name}
            environment = environment.pixels
        environment = load_environment(environment, lookup=variant.lookup, **options)
        options = {"triangle_test": variant.triangle_test, "environment": environment}
        if self.is_loaded:
            intersector = self.scene.ray_intersector.name
            return SceneData(self.scene.mesh, intersector=intersector, view=self.scene.view, **options)
        return load_scene_data(self.scene, **options)
