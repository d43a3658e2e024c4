"""``taichi-tracer effects``: what the effects that a scene does not call for would cost, and what readability costs."""

from argparse import Namespace
from dataclasses import dataclass, replace

from taichi_tracer.apps.names import find_estimator
from taichi_tracer.apps.requests import CameraRequest, SceneRequest, document_of, scene_of
from taichi_tracer.apps.words import given, taken
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies import effects

MOST_FOR_PLAIN = 100_000  # primitives: the plain hierarchy is built in Python, which takes about 20 s for so many


@dataclass(frozen=True)
class EffectsRequest:
    """The picture whose effects are measured, and the two ways to compile it that are compared with the scene's own.

    Attributes:
        scene: compiled for what it calls for.
        estimator: how its light is sampled. sampler: None is the default of ``ProgressiveRenderer``.
    """

    scene: SceneRequest
    estimator: str
    sampler: str | None
    size: tuple[int, int]
    camera: CameraRequest

    @property
    def with_everything(self) -> SceneRequest:
        """The scene, with every effect compiled in."""
        return replace(self.scene, effects="all")

    @property
    def in_plain_forms(self) -> SceneRequest:
        """The scene, in the forms that are there to be read."""
        return replace(self.scene, plain=True)

    def load(self, scene: SceneRequest) -> SceneData:
        """One of the three, seen from where the camera is."""
        loaded, (width, height) = scene.load(), self.size
        loaded.view = self.camera.applied_to(loaded.view_for(width / height), width / height)
        return loaded


def effects_of(args: Namespace) -> EffectsRequest:
    """What the options ask for."""
    needs_light = find_estimator(args.estimator).needs_light
    scene = replace(scene_of(args, document_of(args.scene), needs_light), effects="scene")
    return EffectsRequest(scene, args.estimator, args.sampler, args.size, taken(CameraRequest, args))


def run(args: Namespace) -> int:
    """Print the receipt and the table; 1 when a picture differs, which none should."""
    request = effects_of(args)
    scene = request.load(request.scene)
    print("\n".join(scene.receipt()), end="\n\n", flush=True)
    is_small = scene.geometry.n_primitives <= MOST_FOR_PLAIN
    variants = effects.measure(
        scene,
        complete=request.load(request.with_everything),
        plain=request.load(request.in_plain_forms) if is_small and not request.scene.plain else None,
        estimator=request.estimator,
        width=request.size[0],
        height=request.size[1],
        **given(sampler=request.sampler),
    )
    print("\n".join(effects.table(variants)))
    if not is_small:
        print(f"The plain forms are left out, because the scene has more than {MOST_FOR_PLAIN:,} primitives.")
    return 0 if all(v.is_equal for v in variants) else 1
