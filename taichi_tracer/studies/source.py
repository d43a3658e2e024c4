"""Where the scenes of a study come from, and what it must know of them."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from taichi_tracer.environment import Environment, load_environment
from taichi_tracer.scene_data import SceneData, again
from taichi_tracer.scene_data_loader import load_scene_data
from taichi_tracer.studies.variants import Variant
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.parts.overrides import assigned
from taichi_tracer.system.parts.registry import PARTS

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


class Source:
    """Where a study's scenes come from: a name or a path, read again for every setting, or a scene that is there.

    Args:
        scene: a name, a path, or a ``SceneData``; that one cannot be compared in another precision or with fast math,
            since both would start Taichi anew and end it.
        environment: what lights it, or "none"; None takes the scene's own light, or ``LIGHT`` if it has none.
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
        of_scene: Mapping[str, Any] = MappingProxyType({}),
        view_of: Callable[[dict], dict] | None = None,
        here: bool = False,
        **options,
    ) -> None:
        self.here = here or isinstance(scene, SceneData)
        if isinstance(environment, Environment) and not self.here:  # its fields stay in the process of the caller
            environment, options = unpacked(environment, options)
        self.scene, self.environment, self.options, self.view_of = scene, environment, options, view_of
        self.of_scene = dict(of_scene)

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

    def check(self, variants: Sequence[Variant]) -> None:
        """Raise InputError where a variant needs Taichi to be started anew, and with it the caller's scene to end."""
        settings = runtime.ensure() if self.here else None
        if self.here and any((v.precision, v.fast_math) != (settings.precision, settings.fast_math) for v in variants):
            raise InputError(
                "accuracy: precision and fast math cannot change for a loaded scene, nor for parts that only this "
                "process has: give the name or path of the scene, and parts by --parts"
            )

    def start(self, variant: Variant, arch: str = "auto") -> None:
        """Bring Taichi into the precision of a variant."""
        if not self.here:
            runtime.init(arch, variant.precision, variant.fast_math, force=True)

    def load(self, variant: Variant) -> SceneData:
        """The scene as a variant wants it, in the running precision.

        Raises:
            InputError: it has no light.
        """
        names = "triangle_test", "intersector", "lamp_choice"
        parts = {name: getattr(variant, name) for name in names if getattr(variant, name) is not None}
        load = partial(again, **parts) if self.is_loaded else partial(load_scene_data, **parts, **self.of_scene)
        scene = load(self.scene)
        light = scene.environment if self.environment is None else self.environment
        if light is None and scene.effects.is_dark:
            light = LIGHT
        options = self.options
        if isinstance(light, Environment):
            light, options = unpacked(light, options)
        is_none = light is None or (isinstance(light, str) and light == NO_LIGHT)
        scene.set_environment(None if is_none else load_environment(light, lookup=variant.lookup, **options))
        if scene.effects.is_dark:
            raise InputError(f"accuracy: {scene.source} has no light: give an environment, such as {LIGHT}")
        if self.view_of is not None:
            scene.view = self.view_of(scene.view)
        return scene


def unpacked(environment: Environment, options: dict) -> tuple[np.ndarray, dict]:
    """The pixels of an environment, and its options, unless others are given."""
    own = {name: getattr(environment, name) for name in ("intensity", "rotation", "name")}
    return environment.pixels, own | options


def lives_here_alone(parts: Sequence[str] = ()) -> bool:
    """Whether this process has parts of its user that another process would not find.

    Args:
        parts: files that another process would load.
    """
    files = {str(Path(path).expanduser().resolve()) for path in parts}
    known = [part for path in files for part in PARTS.registered_by(path)]
    own = [part for part in PARTS.everything() if not PARTS.comes_with_package(part)]
    return any(not any(part is other for other in known) for part in own) or (bool(assigned()) and not files)
