"""``taichi-tracer export``: a scene with its camera as RT3 XML. Taichi is not needed for it."""

import sys
from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import numpy as np

from taichi_tracer.apps.choices import document_of, pictures, view_of
from taichi_tracer.files import read
from taichi_tracer.files.shipped import scene_data_dir
from taichi_tracer.formulas.camera_frame import view_of_box
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.rt3.document import Document, FilmSettings, Integrator, Shot, read_rt3
from taichi_tracer.rt3.renderer import RT3Renderer
from taichi_tracer.rt3.write import as_rt3
from taichi_tracer.scene_data_loader import COURSE_VIEW, find_scene
from taichi_tracer.system.errors import InputError

SAME_AS = {"normal": "normal_map"}  # views that an integrator of RT3 shows


def run(args: Namespace) -> int:
    """Write the document; what it cannot say is told on stderr."""
    path = Path(args.output)
    if path.suffix.lower() != ".xml":
        raise InputError(f"{path}: the ending must be .xml")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist")
    document = document_of(args)
    if document is None:
        document = Document(read(find_scene(args.scene)), [])
    shots = [_shot(args, document, picture) for picture in pictures(args)]
    for note in document.mesh.notes:
        print(f"taichi-tracer: note: {note}", file=sys.stderr)
    text = as_rt3(replace(document, shots=shots), path)
    part = path.with_name(f".{path.name}.part.xml")
    try:
        part.write_text(text, encoding="utf-8")
        read_rt3(part)  # what is not read again is not left behind
        part.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None
    finally:
        part.unlink(missing_ok=True)
    print(f"{path}: {len(document.mesh.faces):,} primitives, {len(shots)} pictures, {len(text.encode()):,} bytes")
    return 0


def _shot(args: Namespace, document: Document, picture) -> Shot:
    """One picture, as the arguments change it."""
    old = picture.shot
    view = _default_view(args, document) if old is None else old.view
    film = FilmSettings() if old is None else old.film
    window = film.crop_window if args.crop is None else tuple(args.crop)
    integrator = Integrator() if old is None else old.integrator
    if old is None or args.view is not None:
        integrator = _integrator_of(picture)
    film = replace(film, width=picture.width, height=picture.height, crop_window=window)
    return Shot(view_of(args, view, picture.width / picture.height), film, integrator)


def _default_view(args: Namespace, document: Document) -> dict:
    if find_scene(args.scene).parent == scene_data_dir():
        return COURSE_VIEW
    vertices = document.mesh.vertices[np.unique(document.mesh.faces)]
    return view_of_box(vertices.min(axis=0), vertices.max(axis=0))


def _integrator_of(picture) -> Integrator:
    """The integrator that shows what was asked for."""
    renderer_class, choice = picture.views[0]
    if renderer_class is RT3Renderer:
        return Integrator(choice.name)
    if renderer_class is A2Renderer:
        return Integrator("direct", estimator=choice.name, spp=picture.spp)
    if choice.name not in SAME_AS:
        raise InputError(
            f"RT3 has no integrator that shows {choice.name!r}: known are normal, flat, depth_map, mis, ..."
        )
    return Integrator(SAME_AS[choice.name])
