"""Load a scene by its name or by the path of its file."""

from __future__ import annotations

import functools
import os
import warnings
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from taichi_tracer.environment import load_environment
from taichi_tracer.files import EXTENSIONS, read
from taichi_tracer.files.disk import scene_data_dir
from taichi_tracer.files.meshes import from_trimesh, mesh_from_arrays, with_appearance
from taichi_tracer.formulas.first_view import best_view, guessed_up_axis
from taichi_tracer.geometry import Geometry, Mesh
from taichi_tracer.instances import view_of_mesh
from taichi_tracer.materials import Material, MaterialLibrary
from taichi_tracer.meshes.parts import surface_of
from taichi_tracer.options import SCENE_DEFAULTS, SceneOptions, with_options
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system.errors import InputError, MissingFileError, check_names, one_of
from taichi_tracer.system.importing import import_quickly

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from taichi_tracer.rt3.document import Document

# The camera of the course (A1-16), and the shipped scenes that are composed for a camera. They look best, and as in the
# handouts, from there; the others are single objects, which ``SceneData`` shows in a three-quarter view. Files of users
# are shown from where most is seen of them, see ``formulas.first_view``; the course's cameras are asked, too.
COURSE_VIEW: dict[str, Any] = {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 60.0}
OWN_VIEWS: dict[str, dict[str, Any]] = {
    "caustic_sphere": COURSE_VIEW,
    "cornell_box": COURSE_VIEW,
    "ggx_spheres": {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 33.0},
    "globe": {"eye": (-1.2, 1.7, 3.4), "at": (0, 0.85, 0), "up": (0, 1, 0), "fov": 40.0},
    "many_lights": {"eye": (0, 2.4, 1.9), "at": (0, 0, -0.8), "up": (0, 1, 0), "fov": 45.0},
    "specular_spheres": COURSE_VIEW,
    "still_life": {"eye": (0, 1, 3.5), "at": (0, 0.72, -0.5), "up": (0, 1, 0), "fov": 33.0},
    "veach_plates": {"eye": (0, 5.5, 4.5), "at": (0, 2, -1.5), "up": (0, 1, 0), "fov": 45.0},  # A3-5
    "white_room": COURSE_VIEW,
}

OF_COURSE = COURSE_VIEW, OWN_VIEWS["veach_plates"]

FILE = "file"  # in place of an option: what the scene's file says; a mesh says nothing of light
Y_IS_UP = (".glb", ".gltf")  # files whose format says so


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


def find_scene(name: str | Path | None) -> Path:
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


class SceneName(str, Enum):
    """The scenes of the course. Most of their files are not shipped: see ``find_course_file``."""

    CUBE = "cube"
    SPHERE = "sphere"
    TORUS = "torus"
    MONKEY = "monkey"
    CORNELL_BOX = "cornell_box"
    BUNNY = "bunny"
    VEACH = "veach_wall"
    SPECULAR_SPHERES = "specular_spheres"
    BREAKFAST_ROOM = "breakfast_room"
    CORNELL_BOX_CAUSTIC_SPHERE = "cornell_box_caustic_sphere"


class EnvironmentName(str, Enum):
    """The environments of the course: files, and constants."""

    SHANGHAI = "shanghai"
    STUDIO = "studio"
    FIELD = "field"
    WHITE = "white"
    BLACK = "black"
    GREY = "grey"


CONSTANTS = {
    EnvironmentName.WHITE: np.full((1, 1, 3), 1.0),
    EnvironmentName.BLACK: np.zeros((1, 1, 3)),
    EnvironmentName.GREY: np.full((1, 1, 3), 0.12),
}
# Scenes and environments of this package that stand in for files of the course that are not there.
STAND_INS = {
    SceneName.VEACH: "veach_plates",
    SceneName.CORNELL_BOX_CAUSTIC_SPHERE: "caustic_sphere",
    EnvironmentName.STUDIO: "studio",
}
FOLDERS = "TAICHI_TRACER_SCENES"  # the environment variable with further folders of scenes


def find_course_file(name: SceneName | EnvironmentName, extensions: Sequence[str]) -> str:
    """A file of the course: in a folder that TAICHI_TRACER_SCENES names, or in the working directory's scene_data_dir.

    Returns:
        Its path; where it is not there, the name of the shipped scene or environment that stands in for it.

    Raises:
        MissingFileError: there is neither; the message says where to put the file.
    """
    named = [Path(one) for one in os.environ.get(FOLDERS, "").split(os.pathsep) if one]
    folders = [*named, Path("scene_data_dir")]
    files = [f"{name.value}{extension}" for extension in extensions]
    places = [
        path for folder in folders for file in files for path in (folder / file, *sorted(folder.glob(f"*/{file}")))
    ]
    found = [str(path) for path in places if path.is_file()]
    if found:
        return found[0]
    if name in STAND_INS or name.value in shipped_scenes():
        return STAND_INS.get(name, name.value)
    kind = f"{type(name).__name__}.{name.name}"
    raise MissingFileError(
        f"{kind}: {files[0]} is not shipped: put it into {Path('scene_data_dir').absolute()}, or let the environment "
        f"variable {FOLDERS} name its folder"
    )


@with_options(SceneOptions, SCENE_DEFAULTS, environment=FILE, background=FILE, up_axis=FILE)
def load_scene_data(
    name_or_path: str | Path | SceneName | None = None,
    environment_name: Any = None,
    *,
    scene_name: SceneName | None = None,
    **options: Unpack[SceneOptions],
) -> SceneData:
    """Read a scene.

    Args:
        name_or_path: a name in ``scene_data_dir`` ("cornell_box"), or a path (.obj .ply .stl .glb .gltf .off .xml); or
            a scene of the course.
        environment_name: as in the course, the same as the option ``environment``. A scene of the course is black
            without it, as there. scene_name: the course's name of the first argument.
        options: see ``options.SceneOptions``.

    Raises:
        InputError: the file cannot be used; the message has its name and, if there is one, the line and the value.
    """
    check_names("option of load_scene_data", options, SCENE_DEFAULTS)
    name_or_path = scene_name if name_or_path is None else name_or_path
    if environment_name is None and isinstance(name_or_path, SceneName) and "environment" not in options:
        environment_name = EnvironmentName.BLACK
    if environment_name is not None:
        options["environment"] = environment_name
    environment = options.get("environment")
    if isinstance(environment, EnvironmentName):
        constant = CONSTANTS.get(environment)
        options["environment"] = find_course_file(environment, [".hdr", ".exr"]) if constant is None else constant
    if isinstance(name_or_path, SceneName):
        name_or_path = find_course_file(name_or_path, [".obj"])
    path = find_scene(name_or_path)
    for name in ("up_axis", "environment", "background"):
        if is_file(options.get(name)):
            del options[name]  # type: ignore[misc]  # a name of an option
    if is_document(path):
        return scene_of_document(import_quickly("taichi_tracer.rt3.document").read_rt3(path), **options)
    mesh = read(path)
    options["up_axis"], options["view"] = orientation_and_view(
        path, mesh, options.get("up_axis", FILE), options.get("view")
    )
    return SceneData(mesh, **options)


def orientation_and_view(path: Path, mesh: Mesh, up_axis: str = FILE, view: Any = None) -> tuple[str, Any]:
    """(up_axis, view) of a file, as ``SceneOptions`` takes them: as they were asked for, composed, or guessed.

    Nothing is guessed of a shipped scene, nor of objects in many places. A guess that z points upwards is noted.
    """
    guesses = path.parent != scene_data_dir() and not mesh.instances
    surface = surface_of(mesh) if guesses and (view is None or is_file(up_axis)) else None
    if is_file(up_axis):
        up_axis = "y" if surface is None or path.suffix.lower() in Y_IS_UP else guessed_up_axis(surface)
        if up_axis != "y":
            mesh.notes.append(f"{path}: z points upwards, because a flat base is there: --up-axis y undoes this")
    if view is None and surface is not None:
        view = best_view(surface, up_axis, OF_COURSE if up_axis == "y" else ())
        view = view if isinstance(view, dict) else functools.partial(view_of_mesh, seen_from=view)
    return up_axis, own_view(path) if view is None else view


@with_options(SceneOptions, SCENE_DEFAULTS)
def scene_from_mesh(
    vertices: Any,
    faces: ArrayLike | None = None,
    *,
    color: ArrayLike | None = None,
    material: Material | Sequence[Material] | None = None,
    normals: ArrayLike | None = None,
    face_materials: ArrayLike | None = None,
    uv: ArrayLike | None = None,
    **options: Unpack[SceneOptions],
) -> SceneData:
    """A scene from arrays, from a ``Mesh``, or from a ``trimesh.Trimesh`` or ``trimesh.Scene``.

    Args:
        vertices: (V, 3) float positions; or the ``Mesh``, which may be a ``group``; or the trimesh object.
        faces: (F, 3) int vertex ids, counted from 0, counter-clockwise when seen from the front.
        color: the reflectance Kd of a diffuse material, three numbers from 0 to 1, linear RGB; or (M, 3), one row for
            each of several materials. None, without a ``material``, is a light grey, or what the trimesh object has.
        material: a ``Material`` instead of a colour, or a list of several.
        normals: (V, 3), a normal for each vertex, or (F, 3, 3), a normal for each corner of each triangle. They need
            not have unit length. Without them, triangles are flat; ``smooth=True`` computes normals.
        face_materials: (F,) ids into the colours or materials, counted from 0, one for each triangle.
        uv: (V, 2), a texture coordinate for each vertex, or (F, 3, 2), one for each corner; for a material with a
            ``tt.Texture`` as its ``map_Kd``.
        options: see ``options.SceneOptions``.

    Raises:
        InputError: an array has the wrong shape or a value out of range; the message has the name and the value.
    """
    check_names(
        "option of scene_from_mesh",
        options,
        [*SCENE_DEFAULTS, "color", "material", "normals", "face_materials", "uv"],
    )
    if isinstance(vertices, Mesh):
        mesh = vertices
    else:
        mesh = from_trimesh(vertices) if faces is None else mesh_from_arrays(vertices, faces)
    mesh = with_appearance(mesh, color, material, normals, face_materials, uv)
    if mesh.num_primitives == 0 and not mesh.instances:
        warnings.warn("mesh: it has no triangles: nothing is to be seen", stacklevel=3)
    return SceneData(mesh, **options)


def load_mesh(name_or_path: str | Path) -> Mesh:
    """The ``Mesh`` of a file or of a shipped scene, for ``group`` and ``Instances``, and for ``scene_from_mesh``."""
    path = find_scene(name_or_path)
    if is_document(path):
        return import_quickly("taichi_tracer.rt3.document").read_rt3(path).mesh
    return read(path)


def load_geometry(name_or_path: str | Path | SceneName) -> Geometry:
    """The triangles of a scene, as ``load_scene_data`` reads them."""
    return load_scene_data(name_or_path).geometry


def load_materials(name_or_path: str | Path | SceneName) -> MaterialLibrary:
    """The materials of a scene, as ``load_scene_data`` reads them."""
    return load_scene_data(name_or_path).material_library


def own_view(path: Path) -> dict[str, Any] | None:
    """The camera for which the file of a mesh is composed; None if it has none of its own."""
    return OWN_VIEWS.get(path.stem) if path.parent == scene_data_dir() else None


def is_file(value: Any) -> bool:
    """Whether an environment or a background is left to the scene's file."""
    return isinstance(value, str) and value == FILE


def is_document(path: str | Path) -> bool:
    """Whether a file is a scene of RT3, and not a mesh; its extension decides."""
    return Path(path).suffix.lower() == ".xml"


def scene_of_document(document: Document, **options: Unpack[SceneOptions]) -> SceneData:
    """The scene of an RT3 document, with its background, its environment and its ``shots``. Its world may be empty.

    Args:
        options: see ``options.SceneOptions``; they replace the settings of the document. A ``view`` of None does not.
    """
    if options.get("view") is None:
        options["view"] = document.shots[0].view
    options.setdefault("background", document.background)
    if document.intersector is not None:
        options.setdefault("intersector", document.intersector)
    options["lights"] = (*document.lights, *options.get("lights", ()))
    if "environment" not in options and document.environment is not None:
        options["environment"] = load_environment(str(document.environment), **document.environment_options)
    scene = SceneData(document.mesh, **options)
    scene.shots, scene.lights_of_file = tuple(document.shots), len(document.lights)
    return scene
