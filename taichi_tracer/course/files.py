"""Files that students of the course write, loaded as the modules of a package of their own.

Their relative imports, and those from ``taichi_tracer``, find the other files of the same folder. Files that only hold
data (``ray``, ``geometry``, …), and files that are not there, are those of this package.
"""

import ast
import importlib
import importlib.machinery
import importlib.util
import itertools
import sys
import types
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from taichi_tracer.system.errors import InputError

PACKAGE = "taichi_tracer"
STUDENTS = ("camera", "ray_intersector", "environment", "sampler", "renderer")  # files whose classes are used
OF_PACKAGE = ("ray", "geometry", "materials", "scene_data", "scene_data_loader", "camera_controller")
# What the handouts of the course ask for; the base code around it is not judged. "picture: …" needs all of it.
ASKED: dict[str, dict[str, str]] = {
    "a1": {"Camera": "camera.py", "RayIntersector": "ray_intersector.py"},
    "a2": {
        "Camera": "camera.py",
        "Environment": "environment.py",
        "UniformSampler": "sampler.py",
        "BRDF": "sampler.py",
        "A2Renderer": "renderer.py",
    },
    "a3": {"MeshLightSampler": "sampler.py", "A3Renderer": "renderer.py"},
    "a4": {"A4Renderer": "renderer.py"},
}
GRADUATE: dict[str, dict[str, str]] = {  # what only graduate students hand in
    "a2": {"MicrofacetBRDF": "sampler.py"},
    "a3": {"Environment": "environment.py"},
}
NOT_ASKED = {"RayIntersector.query_ray", "A2Renderer.running_mean", "A3Renderer.to_solid_angle"}
NOT_ASKED |= {"A3Renderer.power_heuristic", "A4Renderer.next_throughput", "A4Renderer.play_roulette"}
NOT_ASKED |= {"A4Renderer.sample_light"}
_numbers = itertools.count(1)


@dataclass
class CourseFiles:
    """The classes of a student's files.

    Attributes:
        folder: where the files are. classes: name → class, as it is written.
        errors: name of a file that cannot be used → what it raised.
    """

    folder: Path
    classes: dict[str, type] = field(default_factory=dict)
    errors: dict[str, BaseException] = field(default_factory=dict)


class _File(importlib.machinery.SourceFileLoader):
    """Runs a file of a student; no bytecode is kept beside it."""

    def get_code(self, fullname: str) -> types.CodeType:
        """The code of the file, whose imports find the student's files, or else the package's.

        What a text editor adds, as a byte order mark, is understood as Python does.
        """
        path = self.get_filename(fullname)
        tree = ast.parse(self.get_data(path), path)
        for node in (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module):
            name = node.module.removeprefix(f"{PACKAGE}.")
            if node.level > 0 or name != node.module:
                is_own = name not in OF_PACKAGE and (Path(path).parent / f"{name}.py").is_file()
                node.module, node.level = (name, 1) if is_own else (f"{PACKAGE}.{name}", 0)
        return compile(tree, path, "exec")


def find_folder(folder: str | Path) -> Path:
    """The folder with a student's files: itself, or ``taichi_tracer`` in it, or one folder deeper.

    Raises:
        InputError: there are none.
    """
    top = Path(folder).expanduser()
    places = [top, top / PACKAGE, *sorted(top.glob(f"*/{PACKAGE}")), *sorted(p for p in top.glob("*") if p.is_dir())]
    for place in places:
        if any((place / f"{name}.py").is_file() for name in STUDENTS):
            return place.resolve()
    raise InputError(f"{folder}: none of {', '.join(f'{name}.py' for name in STUDENTS)} is there")


def load(folder: str | Path, names: Sequence[str] = STUDENTS) -> CourseFiles:
    """The classes that a student's files define. ``errors`` has the files that cannot be run.

    Args:
        names: of the files, without ``.py``.
    """
    found = CourseFiles(find_folder(folder))
    package = types.ModuleType(f"course_files_{next(_numbers)}")
    package.__path__ = [str(found.folder / package.__name__)]  # a name of the folder that no other import uses
    sys.modules[package.__name__] = package
    finder = importlib.machinery.FileFinder(str(found.folder), (_File, [".py"]))
    sys.path_importer_cache[package.__path__[0]] = finder  # stays: functions may import later
    for name in names:
        if not (found.folder / f"{name}.py").is_file():
            continue
        try:
            module = importlib.import_module(f"{package.__name__}.{name}")
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 (a student's file may raise anything, SystemExit too)
            found.errors[f"{name}.py"] = error
            continue
        own = {k: v for k, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__}
        found.classes |= own
    return found


def asks_for(assignment: str, part: str) -> bool:
    """Whether the course's handout of an assignment asks for a part such as "Camera.generate_ray"."""
    is_picture, name = part.startswith("picture"), part.partition(".")[0]
    asked = {*ASKED.get(assignment, {}), *GRADUATE.get(assignment, {})}
    return part not in NOT_ASKED and (is_picture or name in asked)


def is_of_course(folder: Path, files: Sequence[str]) -> bool:
    """Whether files of a folder are written for the course: with relative imports, or with classes of their own.

    A class that a student of this package's assignments writes derives from one of the package's, as ``tt.Camera``.
    """
    names = {name for classes in ASKED.values() for name in classes}
    for file in files:
        try:
            nodes = list(ast.walk(ast.parse((folder / file).read_bytes())))
        except (OSError, SyntaxError, ValueError, RecursionError):
            continue
        has_relative = any(isinstance(node, ast.ImportFrom) and node.level > 0 for node in nodes)
        has_own = any(isinstance(node, ast.ClassDef) and node.name in names and not node.bases for node in nodes)
        if has_relative or has_own:
            return True
    return False


def folder_of_course(folder: str | Path, files: Sequence[str]) -> Path | None:
    """The folder with files that are written for the course, see ``find_folder``; None if there are none."""
    try:
        found = find_folder(folder)
    except InputError:
        return None
    return found if is_of_course(found, [*files, *(f"{name}.py" for name in STUDENTS)]) else None
