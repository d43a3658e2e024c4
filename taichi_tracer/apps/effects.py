"""``taichi-tracer effects``: what the effects that a scene does not call for would cost."""

from argparse import Namespace

from taichi_tracer.apps.choices import load_scene
from taichi_tracer.studies import effects


def run(args: Namespace) -> int:
    """Print the receipt and the table; 1 when a picture differs, which none should."""
    args.effects = "scene"
    scene = load_scene(args)
    print("\n".join(scene.effects.receipt()), end="\n\n", flush=True)
    args.effects = "all"
    complete = load_scene(args)
    args.effects, args.plain = "scene", True
    variants = effects.measure(scene, complete, load_scene(args), args.estimator, *args.size)
    print("\n".join(effects.table(variants)))
    return 0 if all(v.is_equal for v in variants) else 1
