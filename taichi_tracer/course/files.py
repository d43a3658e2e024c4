"""Files that students write, run as the modules of a package of their own.

In files of the course, relative imports, and those from ``taichi_tracer``, find the other files of the same folder.
Files that only hold data (``ray``, ``geometry``, …), and files that are not there, are those of this package.
"""

import ast
import contextlib
import importlib
import importlib.machinery
import importlib.util
import itertools
import sys
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from taichi_tracer.system.errors import InputError

PACKAGE = "taichi_tracer"
KIT = "taichi_tracer.teaching"
FOR_STUDENTS = {f"{KIT}.not_written", f"{KIT}.check"}
NOT_UTF8 = "the file is not in UTF-8: save it so, or name its encoding in its first line, as in # coding: latin-1"
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
NOT_ASKED = {
    "RayIntersector.query_ray",
    "A2Renderer.running_mean",
    "A3Renderer.to_solid_angle",
    "A3Renderer.power_heuristic",
    "A4Renderer.next_throughput",
    "A4Renderer.play_roulette",
    "A4Renderer.sample_light",
}
_numbers = itertools.count(1)


@dataclass
class StudentFiles:
    """The classes of a student's files.

    Attributes:
        folder: where the files are. package: the name of the package whose modules they are.
        module_of: (these files, the name in an import, how many dots stand before it) → the module that is meant.
        classes: name → class, as it is written.
        errors: name of a file that cannot be used → what it raised.
    """

    folder: Path
    module_of: Callable[["StudentFiles", str, int], str]
    package: str = field(default_factory=lambda: f"student_files_{next(_numbers)}")
    classes: dict[str, type] = field(default_factory=dict)
    errors: dict[str, BaseException] = field(default_factory=dict)


class _File(importlib.machinery.SourceFileLoader):
    """Runs a file of a student; no bytecode is kept beside it."""

    def get_code(self, fullname: str) -> types.CodeType:
        """The code of the file, whose imports find what ``StudentFiles.module_of`` says."""
        path, files = self.get_filename(fullname), sys.modules[fullname.rpartition(".")[0]].files
        tree = parsed(Path(path))
        for node in ast.walk(tree):
            imported: list[str] = []
            if isinstance(node, ast.ImportFrom) and node.module:
                imported = [f"{node.module}.{alias.name}" for alias in node.names]
                node.module, node.level = files.module_of(files, node.module, node.level), 0
            elif isinstance(node, ast.Import):
                imported = [alias.name for alias in node.names]
                for alias in (one for one in node.names if "." not in one.name):
                    alias.asname, alias.name = alias.asname or alias.name, files.module_of(files, alias.name, 0)
            for name in imported:
                if name.startswith(f"{KIT}.") and name not in FOR_STUDENTS:
                    raise InputError(f"{name} belongs to the kit that judges: a solution cannot import it")
        return compile(tree, path, "exec")


def parsed(file: Path) -> ast.Module:
    """The syntax tree of a student's file, in UTF-8, with a mark or without, or in the encoding that a line names."""
    try:
        return ast.parse(file.read_bytes(), str(file))  # Python finds the encoding of bytes
    except (SyntaxError, ValueError) as error:
        if "utf-8" in str(error) or "null bytes" in str(error):
            raise SyntaxError(NOT_UTF8) from None
        raise


def run_files(found: StudentFiles, names: Sequence[str]) -> StudentFiles:
    """Run some files of a folder, which may import each other; their classes and errors are put into ``found``."""
    package: Any = types.ModuleType(found.package)
    package.__path__, package.files = [str(found.folder / found.package)], found  # a place that no other import uses
    sys.modules[found.package] = package
    finder = importlib.machinery.FileFinder(str(found.folder), (_File, [".py"]))
    sys.path_importer_cache[package.__path__[0]] = finder  # stays: functions may import later
    for name in names:
        try:
            module = importlib.import_module(f"{found.package}.{name.removesuffix('.py')}")
        except (Exception, SystemExit) as error:
            found.errors[name] = error
        else:
            of_file = {k: v for k, v in vars(module).items() if isinstance(v, type)}
            found.classes |= {k: v for k, v in of_file.items() if v.__module__ == module.__name__}
    return found


def bare(cls: Any, **attributes: Any) -> Any:
    """An object of a student's class that was not constructed, with attributes that its methods need."""
    made = cls.__new__(cls)
    vars(made).update(attributes)
    return made


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


def load(folder: str | Path) -> StudentFiles:
    """The classes that a student's files of the course define. ``errors`` has the files that cannot be run."""
    place = find_folder(folder)
    names = [f"{name}.py" for name in STUDENTS if (place / f"{name}.py").is_file()]
    found = run_files(StudentFiles(place, module_of_course), names)
    # Where there are two, the other one is the base class, in which ``query_ray`` is abstract.
    if "BruteForceRayIntersector" in found.classes:
        found.classes["RayIntersector"] = found.classes["BruteForceRayIntersector"]
    return found


def module_of_course(files: StudentFiles, name: str, level: int) -> str:
    """What a file of the course imports: relative, or from ``taichi_tracer``, another file, or else the package's."""
    short = name.removeprefix(f"{PACKAGE}.")
    if level == 0 and short == name:
        return name
    is_own = short not in OF_PACKAGE and (files.folder / f"{short}.py").is_file()
    return f"{files.package if is_own else PACKAGE}.{short}"


def asks_for(assignment: str, part: str) -> bool:
    """Whether the course's handout of an assignment asks for a part such as "Camera.generate_ray"."""
    is_picture, name = part.startswith("picture"), part.partition(".")[0]
    asked = {*ASKED.get(assignment, {}), *GRADUATE.get(assignment, {})}
    return part not in NOT_ASKED and (is_picture or name in asked)


def folder_of_course(folder: str | Path, files: Sequence[str]) -> Path | None:
    """The folder with files that are written for the course, see ``find_folder``; None if there are none.

    They have relative imports, or classes of their own: a class that a student of this package's assignments writes
    derives from one of the package's, as ``tt.Camera``.
    """
    names = {name for classes in ASKED.values() for name in classes}
    try:
        found = find_folder(folder)
    except InputError:
        return None
    for file in (*files, *(f"{name}.py" for name in STUDENTS)):
        with contextlib.suppress(OSError, SyntaxError, ValueError, RecursionError):
            nodes = list(ast.walk(ast.parse((found / file).read_bytes())))
            has_relative = any(isinstance(node, ast.ImportFrom) and node.level > 0 for node in nodes)
            has_own = any(isinstance(node, ast.ClassDef) and node.name in names and not node.bases for node in nodes)
            if has_relative or has_own:
                return found
    return None
