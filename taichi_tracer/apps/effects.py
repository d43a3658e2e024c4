"""``taichi-tracer effects``: what the effects that a scene does not call for would cost."""

from argparse import Namespace
from dataclasses import replace

from taichi_tracer.apps.names import find_estimator
from taichi_tracer.apps.pictures import Request, request_of
from taichi_tracer.scene_data import SceneData
from taichi_tracer.settings import RenderSettings
from taichi_tracer.studies import effects


def run(args: Namespace) -> int:
    """Print the receipt and the table; 1 when a picture differs, which none should."""
    find_estimator(args.view)
    settings = replace(RenderSettings.of(args), effects="scene")
    request, complete = request_of(settings), request_of(replace(settings, effects="all"))
    width, height = args.size
    scene = load(request)
    print("\n".join(scene.receipt()), end="\n\n", flush=True)
    variants = effects.measure(
        scene,
        complete=load(complete),
        estimator=args.view,
        width=width,
        height=height,
        **settings.given("sampler"),
    )
    print("\n".join(effects.table(variants)))
    return 0 if all(v.is_equal for v in variants) else 1


def load(request: Request) -> SceneData:
    """A scene, seen from where the camera of its first picture is."""
    loaded, picture = request.load(), request.pictures[0]
    width, height = picture.settings.size
    loaded.view = picture.view_of(loaded.view_for(width / height))
    return loaded
