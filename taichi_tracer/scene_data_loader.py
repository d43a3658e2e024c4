"""From a name or a path to a scene."""

from pathlib import Path

from taichi_tracer.errors import InputError, MissingFileError, one_of
from taichi_tracer.files import EXTENSIONS, read
from taichi_tracer.files.shipped import scene_data_dir
from taichi_tracer.scene_data import SceneData

# The course's camera (A1-16); every shipped scene is made for it.
COURSE_VIEW = {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 60.0}


def shipped_scenes() -> dict[str, Path]:
    """Name → file of every shipped scene."""
    files = sorted(p for p in scene_data_dir().iterdir() if p.suffix.lower() in EXTENSIONS)
    return {p.stem: p for p in files}


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
    if path.suffix == "" and path.parent == Path("."):
        raise MissingFileError(str(one_of("scene", str(name), [*shipped, "or the path of a file"])))
    raise MissingFileError(f"{path}: no such file")


def load_scene_data(name_or_path: str | Path, **options) -> SceneData:
    """Read a scene.

    Args:
        name_or_path: a name in ``scene_data_dir`` ("cornell_box"), or a path (.obj .ply .stl .glb .gltf .off).
        options: as for ``SceneData``: intersector, triangle_test, view, environment, effects.

    Raises:
        InputError: the file cannot be used, with its name, the line and the value where there is one.
    """
    path = find_scene(name_or_path)
    mesh = read(path)
    if len(mesh.faces) == 0:
        raise InputError(f"{path}: the file has no triangles")
    if path.parent == scene_data_dir():
        options.setdefault("view", COURSE_VIEW)
    return SceneData(mesh, **options)
