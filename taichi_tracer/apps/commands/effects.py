"""What is compiled for a scene, why, and what the rest would cost."""

from argparse import Namespace
from dataclasses import replace

from taichi_tracer.apps.console import Parser
from taichi_tracer.apps.pictures import Request, camera_for, find_views, request_of
from taichi_tracer.scene_data import SceneData
from taichi_tracer.settings import CAMERA, OF_SCENE, PICTURE_SIZE, RenderSettings, add_option, add_options, add_scene
from taichi_tracer.system.argument_types import size
from taichi_tracer.system.errors import InputError


def add_arguments(parser: Parser) -> None:
    """Add what ``effects`` takes."""
    add_scene(parser, *OF_SCENE)
    what = "how light is sampled (default: %(default)s)"
    parser.add_argument("--estimator", dest="view", default="brdf", metavar="NAME", help=what)
    parser.add_argument("--size", type=size, default=PICTURE_SIZE, metavar="WxH", help="pixels (default: %(default)s)")
    add_option(parser, "sampler")
    add_options(parser, CAMERA)


def run(args: Namespace) -> int:
    """Print the table of effects; 1 when a picture differs, which none should."""
    from taichi_tracer.studies import effects

    if not all(shown.needs_light for _, shown in find_views(args.view)):
        raise InputError(f"--estimator {args.view}: a view needs no light: give an estimator, such as mis")
    settings = replace(RenderSettings.of(args), effects="scene")
    scene, complete = (seen(request_of(replace(settings, effects=mode))) for mode in ("scene", "all"))
    variants = effects.measure(scene, complete, args.view, *args.size, **settings.given("sampler"))
    reasons = scene.effects.reasons
    print("\n".join([*effects.table(variants, reasons), "", *scene.receipt()[len(reasons) :]]))
    return 0 if all(v.is_equal for v in variants) else 1


def seen(request: Request) -> SceneData:
    """A scene, seen from where the camera of its first picture is."""
    scene, settings = request.load(), request.pictures[0].settings
    width, height = settings.size
    scene.view = camera_for(settings, scene.view_for(width / height))
    return scene
