"""From a name or a path to a scene."""

from pathlib import Path

from taichi_tracer.environment import load_environment
from taichi_tracer.files import EXTENSIONS, read
from taichi_tracer.files.shipped import scene_data_dir
from taichi_tracer.rt3.document import Document, read_rt3
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system.errors import InputError, MissingFileError, one_of

# The course's camera (A1-16); every shipped scene is made for it.
COURSE_VIEW = {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 60.0}


def shipped_scenes() -> dict[str, Path]:
    """Name → file of every shipped scene; those of RT3 are called ``rt3/…``."""
    files = sorted(p for p in scene_data_dir().iterdir() if p.suffix.lower() in EXTENSIONS)
    documents = sorted((scene_data_dir() / "rt3").glob("*.xml"))
    return {p.stem: p for p in files} | {f"rt3/{p.stem}": p for p in documents}


def scene_names() -> list[str]:
    """The names that ``load_scene_data`` knows."""
    return list(shipped_scenes())


def find_scene(name: str | Path) -> Path:
    """The file of a shipped name or of a path."""
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
        options: as for ``SceneData``: intersector, triangle_test, view, environment, effects, background, brdfs,
            lights, fast.

    Raises:
        InputError: the file cannot be used, with its name, the line and the value where there is one.
    """
    path = find_scene(name_or_path)
    if is_document(path):
        return scene_of_document(read_rt3(path), **options)
    mesh = read(path)
    if len(mesh.faces) == 0:
        raise InputError(f"{path}: the file has no triangles")
    if path.parent == scene_data_dir():
        options.setdefault("view", COURSE_VIEW)
    return SceneData(mesh, **options)


def is_document(path: str | Path) -> bool:
    """Whether a file is a scene of RT3, and not a mesh."""
    return Path(path).suffix.lower() == ".xml"


def scene_of_document(document: Document, **options) -> SceneData:
    """The scene of an RT3 document, with its background, its surroundings and its ``shots``; an empty world is one too.

    Args:
        options: as for ``SceneData``; what is given counts instead of what the document says.
    """
    options.setdefault("view", document.shots[0].view)
    options.setdefault("background", document.background)
    if "environment" not in options and document.environment is not None:
        options["environment"] = load_environment(str(document.environment), **document.environment_options)
    scene = SceneData(document.mesh, **options)
    scene.shots = tuple(document.shots)
    return scene
