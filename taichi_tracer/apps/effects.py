"""``taichi-tracer effects``: what the effects that a scene does not call for would cost."""

from argparse import Namespace
from dataclasses import replace

from taichi_tracer.apps.names import find_estimator
from taichi_tracer.apps.requests import CameraRequest, SceneRequest, document_of, scene_of
from taichi_tracer.apps.words import given, request_from
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies import effects


def run(args: Namespace) -> int:
    """Print the receipt and the table; 1 when a picture differs, which none should."""
    needs_light = find_estimator(args.estimator).needs_light
    request = replace(scene_of(args, document_of(args.scene), needs_light), effects="scene")
    camera, (width, height) = request_from(CameraRequest, args), args.size

    def load(scene: SceneRequest) -> SceneData:
        """A scene, seen from where the camera is."""
        loaded = scene.load()
        loaded.view = camera.applied_to(loaded.view_for(width / height), width / height)
        return loaded

    scene = load(request)
    print("\n".join(scene.receipt()), end="\n\n", flush=True)
    variants = effects.measure(
        scene,
        complete=load(replace(request, effects="all")),
        estimator=args.estimator,
        width=width,
        height=height,
        **given(sampler=args.sampler),
    )
    print("\n".join(effects.table(variants)))
    return 0 if all(v.is_equal for v in variants) else 1
