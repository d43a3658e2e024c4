"""Load a scene by its name or by the path of its file."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from taichi_tracer.environment import load_environment
from taichi_tracer.files import EXTENSIONS, read
from taichi_tracer.files.shipped import scene_data_dir
from taichi_tracer.formulas.triangles import TriangleTest
from taichi_tracer.rt3.document import Document, read_rt3
from taichi_tracer.scene_data import (
    BackgroundChoice,
    BrdfChoice,
    EnvironmentChoice,
    IntersectorChoice,
    LampChoices,
    LightChoice,
    SceneData,
)
from taichi_tracer.system.errors import InputError, MissingFileError, one_of

# The camera of the course (A1-16), and the shipped scenes that are composed for a camera. They look best, and as in the
# handouts, from there; the others are single objects, which ``SceneData`` shows in a three-quarter view.
COURSE_VIEW: dict[str, Any] = {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 60.0}
OWN_VIEWS: dict[str, dict[str, Any]] = {
    "caustic_sphere": COURSE_VIEW,
    "cornell_box": COURSE_VIEW,
    "many_lights": {"eye": (0, 2.4, 1.9), "at": (0, 0, -0.8), "up": (0, 1, 0), "fov": 45.0},
    "specular_spheres": COURSE_VIEW,
    "veach_plates": {"eye": (0, 5.5, 4.5), "at": (0, 2, -1.5), "up": (0, 1, 0), "fov": 45.0},  # A3-5
    "white_room": COURSE_VIEW,
}

FILE = "file"  # in place of an environment or a background: what the scene's file says; a mesh says nothing


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


def load_scene_data(
    name_or_path: str | Path,
    *,
    intersector: IntersectorChoice = "bvh",
    triangle_test: str | TriangleTest = "watertight",
    view: dict[str, Any] | None = None,
    environment: EnvironmentChoice = FILE,
    effects: str = "scene",
    background: BackgroundChoice = FILE,
    brdfs: Sequence[BrdfChoice] = (),
    lights: Sequence[LightChoice] = (),
    fast: bool = True,
    smooth: bool | float = False,
    up_axis: str = "y",
    lamp_choice: LampChoices | None = None,
    two_sided_lamps: bool = False,
) -> SceneData:
    """Read a scene.

    Args:
        name_or_path: a name in ``scene_data_dir`` ("cornell_box"), or a path (.obj .ply .stl .glb .gltf .off .xml).
        view: as for ``SceneData``; None takes the camera of the file, or that of the course for some shipped meshes.
        environment, background: as for ``SceneData``; "file" takes those of the file, which only .xml can have.
        intersector, triangle_test, effects, brdfs, lights, fast, smooth, up_axis, lamp_choice, two_sided_lamps: as for
            ``SceneData``.

    Raises:
        InputError: the file cannot be used; the message has its name and, if there is one, the line and the value.
    """
    path = find_scene(name_or_path)
    options: dict[str, Any] = {"intersector": intersector, "triangle_test": triangle_test, "effects": effects}
    options |= {"view": view, "brdfs": brdfs, "lights": lights, "fast": fast, "smooth": smooth, "up_axis": up_axis}
    options |= {"lamp_choice": lamp_choice, "two_sided_lamps": two_sided_lamps}
    said = {"environment": environment, "background": background}
    options |= {name: value for name, value in said.items() if not is_file(value)}
    if is_document(path):
        return scene_of_document(read_rt3(path), **options)
    mesh = read(path)
    if len(mesh.faces) == 0:
        raise InputError(f"{path}: the file has no triangles")
    if view is None:
        options["view"] = own_view(path)
    return SceneData(mesh, **options)


def own_view(path: Path) -> dict[str, Any] | None:
    """The camera for which the file of a mesh is composed; None if it has none of its own."""
    return OWN_VIEWS.get(path.stem) if path.parent == scene_data_dir() else None


def is_file(value: Any) -> bool:
    """Whether an environment or a background is left to the scene's file."""
    return isinstance(value, str) and value == FILE


def is_document(path: str | Path) -> bool:
    """Whether a file is a scene of RT3, and not a mesh; its extension decides."""
    return Path(path).suffix.lower() == ".xml"


def scene_of_document(document: Document, **options: Any) -> SceneData:
    """The scene of an RT3 document, with its background, its environment and its ``shots``. Its world may be empty.

    Args:
        options: arguments of ``SceneData``; they replace the settings of the document. A ``view`` of None does not.
    """
    if options.get("view") is None:
        options["view"] = document.shots[0].view
    options.setdefault("background", document.background)
    if "environment" not in options and document.environment is not None:
        options["environment"] = load_environment(str(document.environment), **document.environment_options)
    scene = SceneData(document.mesh, **options)
    scene.shots = tuple(document.shots)
    return scene
