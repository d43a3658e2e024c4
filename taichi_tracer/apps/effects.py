"""``taichi-tracer effects``: what the effects that a scene does not call for would cost, and what readability costs."""

from argparse import Namespace
from dataclasses import replace

from taichi_tracer.apps.names import find_estimator
from taichi_tracer.apps.requests import CameraRequest, SceneRequest, document_of, scene_of
from taichi_tracer.apps.words import given, request_from
from taichi_tracer.scene_data import SceneData
from taichi_tracer.studies import effects

MOST_FOR_PLAIN = 100_000  # primitives: the plain hierarchy is built in Python, which takes about 20 s for so many


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
    is_small = scene.geometry.n_primitives <= MOST_FOR_PLAIN
    variants = effects.measure(
        scene,
        complete=load(replace(request, effects="all")),
        plain=load(replace(request, plain=True)) if is_small and not request.plain else None,
        estimator=args.estimator,
        width=width,
        height=height,
        **given(sampler=args.sampler),
    )
    print("\n".join(effects.table(variants)))
    if not is_small:
        print(f"The plain forms are left out, because the scene has more than {MOST_FOR_PLAIN:,} primitives.")
    return 0 if all(v.is_equal for v in variants) else 1
