"""``taichi-tracer export``: a scene with its camera as RT3 XML. Taichi is not needed for it."""

from argparse import Namespace
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from taichi_tracer.apps.requests import PictureRequest, document_of, pictures_of, up_axis_of
from taichi_tracer.apps.words import note
from taichi_tracer.assignments import A2Renderer
from taichi_tracer.files import read
from taichi_tracer.formulas.camera_frame import view_of_points
from taichi_tracer.geometry import clean, visible_points
from taichi_tracer.rt3.document import Document, FilmSettings, Integrator, Shot, read_rt3
from taichi_tracer.rt3.renderer import RT3Renderer
from taichi_tracer.rt3.write import as_rt3
from taichi_tracer.scene_data_loader import find_scene, own_view
from taichi_tracer.system.errors import InputError

SAME_AS = {"normal": "normal_map"}  # views that an integrator of RT3 shows


@dataclass(frozen=True)
class ExportRequest:
    """The scene to be written, and the pictures of it that its file is to ask for.

    Attributes:
        scene: a shipped name or a path. document: what its file says, where it is one of RT3; None for a mesh.
        output: the file to write.
        up_axis: the axis that is upright in the view of a mesh, "y" or "z".
    """

    scene: Path
    document: Document | None
    pictures: tuple[PictureRequest, ...]
    output: Path
    up_axis: str


def export_of(args: Namespace) -> ExportRequest:
    """What the options ask for; InputError where the file could not be written."""
    path = Path(args.output)
    if path.suffix.lower() != ".xml":
        raise InputError(f"{path}: the ending must be .xml")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist")
    document = document_of(args.scene)
    return ExportRequest(find_scene(args.scene), document, pictures_of(args, document), path, up_axis_of(args))


def run(args: Namespace) -> int:
    """Write the document; what it cannot say is told on stderr."""
    request = export_of(args)
    path, document = request.output, request.document
    if document is None:
        document = Document(read(request.scene), [])
    shots = [_shot(picture, request, document) for picture in request.pictures]
    for text in document.mesh.notes:
        note(text)
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


def _shot(picture: PictureRequest, request: ExportRequest, document: Document) -> Shot:
    """One picture, as the command line changes it."""
    old = picture.shot
    view = _default_view(document, request, picture.width / picture.height) if old is None else old.view
    film = FilmSettings() if old is None else old.film
    integrator = _integrator_of(picture) if old is None or picture.names_view else old.integrator
    film = replace(film, width=picture.width, height=picture.height, crop_window=picture.crop_window)
    return Shot(picture.view_of(view), film, integrator)


def _default_view(document: Document, request: ExportRequest, aspect: float) -> dict:
    """The camera of a mesh: its own, if it is composed for one, else the one that ``SceneData`` computes."""
    own = own_view(request.scene)
    points = visible_points(clean(document.mesh, np.float64))
    return view_of_points(points, request.up_axis, aspect=min(1.0, aspect)) if own is None else own


def _integrator_of(picture: PictureRequest) -> Integrator:
    """The integrator that shows what was asked for."""
    renderer_class, shown = picture.views[0]
    if issubclass(renderer_class, RT3Renderer):
        return Integrator(shown.name)
    if issubclass(renderer_class, A2Renderer):
        return Integrator("direct", estimator=shown.name, spp=picture.spp)
    if shown.name not in SAME_AS:
        raise InputError(
            f"RT3 has no integrator that shows {shown.name!r}: known are normal, flat, depth_map, mis, ..."
        )
    return Integrator(SAME_AS[shown.name])
