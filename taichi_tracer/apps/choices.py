"""From the words on the command line to scenes and renderers. Names are read where they are defined."""

import sys
from argparse import Namespace
from pathlib import Path

from taichi_tracer import renderer as renderer_module
from taichi_tracer import runtime
from taichi_tracer.environment import load_environment
from taichi_tracer.errors import one_of
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import find_scene, load_scene_data, scene_names


def renderers() -> list[type[ProgressiveRenderer]]:
    """Every renderer of ``renderer.py`` that offers something, in the file's order."""
    classes = [c for c in vars(renderer_module).values() if isinstance(c, type) and issubclass(c, ProgressiveRenderer)]
    return [c for c in classes if len(c.offers) > 0]


def find_views(text: str) -> list[tuple[type[ProgressiveRenderer], object]]:
    """(renderer class, choice) for every name in a comma-separated list; "all" is all that the first renderer offers.

    A name that several renderers offer belongs to the first of them.

    Raises:
        InputError: a name that none of them offers.
    """
    if text == "all":
        return [(renderers()[0], choice) for choice in renderers()[0].offers]
    known = {}
    for renderer_class in renderers():
        for choice in renderer_class.offers:
            for name in (choice.name, *choice.aliases):
                known.setdefault(name, (renderer_class, choice))
    found = []
    for name in text.split(","):
        if name not in known:
            raise one_of("view", name, [*view_names(), "all"])
        found.append(known[name])
    return found


def view_names() -> list[str]:
    """Every name that some renderer offers, once."""
    return list(dict.fromkeys(name for c in renderers() for name in c.names()))


def help_text() -> str:
    """The end of a command's help: the names that can be given."""
    lines = {f"{c.what}s": c.names() for c in renderers()}
    lines[f"{renderers()[0].what}s"] += ["all"]
    lines |= {"scenes": scene_names(), "environments": list(shipped_environments())}
    return "\n" + "".join(f"{name + ':':<14}{', '.join(known)}\n" for name, known in lines.items())


def needs_light(args: Namespace) -> bool:
    """Whether something is asked for that light has to be simulated for."""
    asked = getattr(args, "view", None) or getattr(args, "estimator", None)
    return asked is not None and any(renderer_class.needs_light for renderer_class, _ in find_views(asked))


def environment_of(args: Namespace):
    """The environment that the arguments ask for; where light is needed and none is named, the studio."""
    name = args.environment
    if name is None and needs_light(args):
        name = "studio"
    if name is None or name == "none":
        return None
    options = {"intensity": args.intensity, "rotation": args.rotation, "lookup": args.lookup}
    return load_environment(name, **{key: value for key, value in options.items() if value is not None})


def load_scene(args: Namespace) -> SceneData:
    """Start Taichi and read the scene as the arguments say; what the user should know about it goes to stderr."""
    find_scene(args.scene)  # before Taichi starts
    runtime.init(args.arch, args.precision, args.fast_math)
    options = {"intersector": args.intersector, "triangle_test": args.triangle_test, "effects_mode": args.effects}
    options["environment"] = environment_of(args)
    scene = load_scene_data(args.scene, **{name: value for name, value in options.items() if value is not None})
    for note in scene.notes:
        print(f"taichi-tracer: note: {note}", file=sys.stderr)
    return scene


def make_renderer(renderer_class: type[ProgressiveRenderer], scene: SceneData, args: Namespace) -> ProgressiveRenderer:
    """A renderer with the size and the camera that the arguments ask for."""
    width, height = args.size
    options = {} if args.sampler is None else {"sampler": args.sampler}
    if args.jitter:
        options["jitter"] = True
    options["adaptive"] = getattr(args, "adaptive", False)
    options["first_sample"] = getattr(args, "first_sample", 0)
    renderer = renderer_class(scene_data=scene, width=width, height=height, seed=args.seed, **options)
    renderer.camera.set_camera_parameters(args.eye, args.at, args.up, args.fov, args.handedness)
    return renderer


def scene_label(scene: SceneData) -> str:
    """A short name of the scene, for file names: that of its file."""
    return Path(scene.source).stem
