"""From the words on the command line to scenes and renderers. Names are read where they are defined."""

import sys
from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path

from taichi_tracer.camera import change_projection, make_camera, without_angle
from taichi_tracer.environment import load_environment
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.renderer import ProgressiveRenderer
from taichi_tracer.rt3.document import Document, FilmSettings, Integrator, Shot, crop_pixels, read_rt3
from taichi_tracer.rt3.renderer import RT3Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import find_scene, is_document, load_scene_data, scene_names, scene_of_document
from taichi_tracer.system import runtime
from taichi_tracer.system.errors import one_of
from taichi_tracer.system.registry import PARTS

QUICK = 4  # a quick picture has a quarter of the width and of the height


@dataclass(frozen=True)
class Picture:
    """One picture that is asked for: by a scene file, and by the command line, which wins.

    Attributes:
        width, height: pixels of the whole frame. crop: (x0, x1, y0, y1) in pixels.
        views: (renderer class, choice) of everything to show.
        spp: samples per pixel.
        shot: what the scene file says; None for a mesh.
        filename: where the scene file wants it; None where it says nothing, or something else is shown.
    """

    width: int
    height: int
    crop: tuple[int, int, int, int]
    views: list
    spp: int
    shot: Shot | None
    filename: str | None


def renderers() -> list[type[ProgressiveRenderer]]:
    """Every renderer that offers something."""
    return [c for c in PARTS.all("renderer") if len(c.offered()) > 0]


def find_views(text: str) -> list[tuple[type[ProgressiveRenderer], object]]:
    """(renderer class, choice) for every name in a comma-separated list; "all" is all that the first renderer offers.

    A name that several renderers offer belongs to the first of them.

    Raises:
        InputError: a name that none of them offers.
    """
    if text == "all":
        return [(renderers()[0], choice) for choice in renderers()[0].offered()]
    known = {}
    for renderer_class in renderers():
        for choice in renderer_class.offered():
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


def document_of(args: Namespace) -> Document | None:
    """The RT3 document that the arguments name, read once; None where they name a mesh."""
    if not hasattr(args, "document"):
        path = find_scene(args.scene)
        args.document = read_rt3(path) if is_document(path) else None
    return args.document


def pictures(args: Namespace) -> list[Picture]:
    """The pictures to be made: those of the scene file, or one; what the command line says counts instead."""
    document = document_of(args)
    return [_picture(args, shot) for shot in ([None] if document is None else document.shots)]


def _picture(args: Namespace, shot: Shot | None) -> Picture:
    film = FilmSettings() if shot is None else shot.film
    integrator = Integrator("normal") if shot is None else shot.integrator
    width, height = args.size or (film.width, film.height)
    if args.quick:
        width, height = max(1, width // QUICK), max(1, height // QUICK)
    crop = crop_pixels(film.crop_window if args.crop is None else args.crop, width, height)
    views = find_views(args.view or (integrator.estimator if integrator.name == "direct" else integrator.name))
    spp = getattr(args, "spp", None) or integrator.spp
    return Picture(width, height, crop, views, spp, shot, film.filename if args.view is None else None)


def needs_light(args: Namespace) -> bool:
    """Whether something is asked for that light has to be simulated for."""
    if hasattr(args, "view"):
        asked = [view for picture in pictures(args) for view in picture.views]
    else:
        asked = find_views(args.estimator) if hasattr(args, "estimator") else []
    return any(choice.needs_light for _, choice in asked)


def environment_of(args: Namespace):
    """The environment that the arguments ask for, or the scene file; where light is needed and none is, the studio."""
    document = document_of(args)
    name, options = args.environment, {}
    if name is None and document is not None and document.environment is not None:
        name, options = str(document.environment), dict(document.environment_options)
    if name is None and needs_light(args):
        name = "studio"
    if name is None or name == "none":
        return None
    given = {"intensity": args.intensity, "rotation": args.rotation, "lookup": args.lookup}
    options |= {key: value for key, value in given.items() if value is not None}
    return load_environment(name, **options)


def load_scene(args: Namespace) -> SceneData:
    """Start Taichi and read the scene as the arguments say; what the user should know about it goes to stderr."""
    document = document_of(args)  # before Taichi starts
    runtime.init(args.arch, args.precision, args.fast_math)
    options = {"intersector": args.intersector, "triangle_test": args.triangle_test, "effects": args.effects}
    options = {name: value for name, value in options.items() if value is not None}
    options["environment"] = environment_of(args)
    scene = load_scene_data(args.scene, **options) if document is None else scene_of_document(document, **options)
    for note in scene.notes:
        print(f"taichi-tracer: note: {note}", file=sys.stderr)
    return scene


def view_of(args: Namespace, view: dict, aspect: float) -> dict:
    """Camera parameters: those of a scene or a scene file, and instead of them what the arguments say.

    Args:
        aspect: width / height of the picture.
    """
    view = dict(view) if args.camera is None else change_projection(view, args.camera)
    if args.fov is not None or args.window is not None:
        view.pop("fov", None)
        view.pop("screen_window", None)
    given = {"eye": args.eye, "at": args.at, "up": args.up, "fov": args.fov, "screen_window": args.window}
    given["handedness"] = args.handedness
    view |= {name: value for name, value in given.items() if value is not None}
    return without_angle(view, aspect) if view.get("projection") == "orthographic" else view


def make_renderer(
    renderer_class: type[ProgressiveRenderer], scene: SceneData, args: Namespace, picture: Picture | None = None
) -> ProgressiveRenderer:
    """A renderer with the size, the crop and the camera of a picture, the first that is asked for when None."""
    picture = pictures(args)[0] if picture is None else picture
    options = {} if args.sampler is None else {"sampler": args.sampler}
    if args.jitter:
        options["jitter"] = True
    options["adaptive"] = getattr(args, "adaptive", False)
    options["first_sample"] = getattr(args, "first_sample", 0)
    view = scene.view if picture.shot is None else picture.shot.view
    view = view_of(args, view, picture.width / picture.height)
    camera = make_camera(picture.width, picture.height, **view)
    renderer = renderer_class(scene_data=scene, camera=camera, crop=picture.crop, seed=args.seed, **options)
    if picture.shot is not None and isinstance(renderer, RT3Renderer):
        renderer.set_depth(**picture.shot.integrator.depth)
    return renderer


def scene_label(scene: SceneData) -> str:
    """A short name of the scene, for file names: that of its file."""
    return Path(scene.source).stem
