"""Write a scene and its camera as RT3 XML."""

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

from taichi_tracer.apps.console import Parser, note
from taichi_tracer.apps.pictures import Picture, camera_for, request_of
from taichi_tracer.files.disk import check_place, replace_file
from taichi_tracer.instances import resolve_instances
from taichi_tracer.options import lights_of
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.rt3.document import Document, FilmSettings, IntegratorSettings, Shot
from taichi_tracer.rt3.renderer import RT3Renderer
from taichi_tracer.rt3.write import as_rt3
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import load_scene_data
from taichi_tracer.settings import ADVICE, OF_PICTURE, RenderSettings, add_option, add_options, add_scene
from taichi_tracer.system.errors import InputError

SAME_AS = {"normal": "normal_map"}  # views that an integrator of RT3 shows


def add_arguments(parser: Parser) -> None:
    """Add what ``export`` takes."""
    add_scene(parser)
    add_option(parser, "up_axis")
    parser.add_argument("output", metavar="OUT.xml", help="file to write; the meshes stand in it, number by number")
    add_options(parser, ADVICE, *OF_PICTURE)


def run(args: Namespace) -> int:
    """Write the document; what it cannot say is a note on stderr."""
    path = Path(args.output)
    if path.suffix.lower() != ".xml":
        raise InputError(f"{path}: the ending must be .xml")
    check_place(path)
    request = request_of(RenderSettings.of(args))
    document, scene = request.document, None
    if document is None:
        scene = load_scene_data(args.scene, **request.settings.given("up_axis"))
        document = Document(scene.given_mesh, [], lights_of(scene.given_mesh))
    shots = [_shot(picture, scene) for picture in request.pictures]
    whole = resolve_instances(document.mesh)
    if whole.has_pictures or whole.corner_color is not None:
        note("textures and colours of vertices are not written: RT3 has none")
    for text in whole.notes:
        note(text)
    text = as_rt3(replace(document, shots=shots), path)
    replace_file(path, text.encode())
    count = whole.num_primitives if whole.placed is None else whole.placed.starts[-1]
    print(f"{path}: {count:,} primitives, {len(shots)} pictures, {len(text.encode()):,} bytes")
    return 0


def _shot(picture: Picture, scene: SceneData | None) -> Shot:
    """One picture, as the command line changes it; ``scene`` is that of a mesh, which has the camera then."""
    old, (width, height) = picture.shot, picture.settings.size
    view = old.view if scene is None else scene.view_for(width / height)
    film = FilmSettings() if old is None else old.film
    integrator = _integrator_of(picture) if old is None or picture.names_view else old.integrator
    film = replace(film, width=width, height=height, crop_window=picture.settings.crop)
    return Shot(camera_for(picture.settings, view), film, integrator)


def _integrator_of(picture: Picture) -> IntegratorSettings:
    """The integrator that shows what was asked for."""
    name = picture.integrator.name
    if issubclass(picture.renderer_class, RT3Renderer):
        return IntegratorSettings(name)
    if issubclass(picture.renderer_class, A2Renderer):
        return IntegratorSettings(name, picture.target.spp)
    if name not in SAME_AS:
        raise InputError(f"RT3 has no integrator that shows {name!r}: known are normal, flat, depth_map, mis, ...")
    return IntegratorSettings(SAME_AS[name])
