"""Load a scene by its name or by the path of its file."""

import os
from pathlib import Path

from taichi_tracer.environment import load_environment
from taichi_tracer.files import EXTENSIONS, read
from taichi_tracer.files.shipped import scene_data_dir
from taichi_tracer.rt3.document import Document, read_rt3
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system.errors import InputError, MissingFileError, one_of

# The camera of the course (A1-16). Every shipped mesh is made for this camera, unless it stands in ``OWN_VIEWS``.
COURSE_VIEW = {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 60.0}
OWN_VIEWS = {
    "many_lights": {"eye": (0, 2.4, 1.9), "at": (0, 0, -0.8), "up": (0, 1, 0), "fov": 45.0},
    "veach_plates": {"eye": (0, 5.5, 4.5), "at": (0, 2, -1.5), "up": (0, 1, 0), "fov": 45.0},  # A3-5
}


def shipped_scenes() -> dict[str, Path]:
    """Name → file of every shipped scene. The names of RT3 scenes begin with ``rt3/``."""
    files = sorted(p for p in scene_data_dir().iterdir() if p.suffix.lower() in EXTENSIONS)
    documents = sorted((scene_data_dir() / "rt3").glob("*.xml"))
    return {p.stem: p for p in files} | {f"rt3/{p.stem}": p for p in documents}


def scene_names() -> list[str]:
    """The names of the shipped scenes, for ``load_scene_data``."""
    return list(shipped_scenes())


def name_of(source: str | Path) -> str:
    """The name of a shipped scene where ``source`` is its file; any other source as it is."""
    names = {path: name for name, path in shipped_scenes().items()}
    return names.get(Path(source), str(source))


def find_scene(name: str | Path) -> Path:
    """The file that belongs to the name of a shipped scene or to a path."""
    if not isinstance(name, str | os.PathLike):
        raise InputError(f"scene: give the name of a shipped scene or the path of a file, not {name!r}")
    shipped = shipped_scenes()
    if str(name) in shipped:
        return shipped[str(name)]
    path = Path(name).expanduser()
    if path.exists():
        return path
    if path.suffix == "" and str(path.parent) in (".", "rt3"):
        raise MissingFileError(str(one_of("scene", str(name), [*shipped, "or the path of a file"])))
    raise MissingFileError(f"{path}: no such file")


def load_scene_data(name_or_path: str | Path, **options) -> SceneData:
    """Read a scene.

    Args:
        name_or_path: a name in ``scene_data_dir`` ("cornell_box"), or a path (.obj .ply .stl .glb .gltf .off .xml).
        options: arguments of ``SceneData``: intersector, triangle_test, view, environment, effects, background, brdfs,
            lights, fast.

    Raises:
        InputError: the file cannot be used; the message has its name and, if there is one, the line and the value.
    """
    path = find_scene(name_or_path)
    if is_document(path):
        return scene_of_document(read_rt3(path), **options)
    mesh = read(path)
    if len(mesh.faces) == 0:
        raise InputError(f"{path}: the file has no triangles")
    if path.parent == scene_data_dir():
        options.setdefault("view", OWN_VIEWS.get(path.stem, COURSE_VIEW))
    return SceneData(mesh, **options)


def is_document(path: str | Path) -> bool:
    """Whether a file is a scene of RT3, and not a mesh; its extension decides."""
    return Path(path).suffix.lower() == ".xml"


def scene_of_document(document: Document, **options) -> SceneData:
    """The scene of an RT3 document, with its background, its environment and its ``shots``. Its world may be empty.

    Args:
        options: arguments of ``SceneData``; they replace the settings of the document.
    """
    options.setdefault("view", document.shots[0].view)
    options.setdefault("background", document.background)
    if "environment" not in options and document.environment is not None:
        options["environment"] = load_environment(str(document.environment), **document.environment_options)
    scene = SceneData(document.mesh, **options)
    scene.shots = tuple(document.shots)
    return scene
