"""What a worker renders: the settings of a picture, and the contents of the files that they name.

Paths of the sender do not travel. In the settings, a file is named by its place within the job, such as
``scene/box.obj``; shipped scenes and environments keep their names, because every worker has the same package.
"""

import hashlib
import importlib.metadata
import os
import pickle
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import taichi_tracer
from taichi_tracer import settings as groups
from taichi_tracer.files.disk import make_folder, read_bytes, replace_file, shipped_environments
from taichi_tracer.scene_data_loader import name_of, shipped_scenes
from taichi_tracer.settings import NO_NAME, OPTIONS, RenderSettings
from taichi_tracer.system import runtime

# What only the sender needs: where samples are kept, and when the picture ends.
STAYS = {"spp", "time", "error", "bounces", "checkpoint", "checkpoint_every"}
CAMERA = {"eye", "at", "up", "fov"}  # pictures that differ only in these share a renderer on a worker
# Pictures that differ only in these share a scene. A view belongs to it: one that needs light gives it the usual one.
OF_PICTURE = {name for name, one in OPTIONS.items() if one.group in (*groups.OF_PICTURE, groups.DISPLAY)} - {"view"}


# ── versions ──


@cache
def installation() -> dict[str, str]:
    """What must be the same on all machines."""
    digest, package = hashlib.sha256(), Path(taichi_tracer.__file__).parent
    for path in sorted(package.rglob("*.py"), key=lambda path: path.relative_to(package).as_posix()):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return {
        "taichi_tracer": f"{taichi_tracer.__version__} (source {digest.hexdigest()[:12]})",
        "Taichi": importlib.metadata.version("taichi"),
        "Python": f"{sys.version_info.major}.{sys.version_info.minor}",
    }


def difference(theirs: dict[str, str], ours: dict[str, str]) -> str:
    """What differs, by name with both values: "Taichi 1.7.3 there, 1.7.4 here"; "" if nothing does."""
    names = [name for name in ours if theirs.get(name) != ours[name]]
    return ", ".join(f"{name} {theirs.get(name, 'unknown')} there, {ours[name]} here" for name in names)


# ── jobs ──


@dataclass(frozen=True)
class Job:
    """A picture, ready to travel.

    Attributes:
        settings: those of the picture that are not the default; files are named by their places.
        files: place → content.
        which: (number of the picture, number of its view, bounces or None), where settings ask for several.
        threads: how many processors a worker uses; None for all.
        facts: everything that the bits of the picture depend on, as the sender has them; None does not check them.
        shares: of the pixels of an adaptive picture, see ``picture.adaptive``.
        versions: what is installed at the sender.
    """

    settings: dict[str, Any]
    files: dict[str, bytes]
    which: tuple = (0, 0, None)
    threads: int | None = None
    facts: dict[str, Any] | None = None
    shares: Any = None
    versions: dict[str, str] = field(default_factory=installation)

    def key(self, without: set[str]) -> str:
        """A name that is equal for equal files, and equal settings but for these."""
        options = sorted((name, repr(value)) for name, value in self.settings.items() if name not in without)
        return hashlib.sha256(pickle.dumps([options, self.threads, sorted(self.files.items())])).hexdigest()

    @cached_property
    def keys(self) -> tuple[str, tuple]:
        """A name that is equal for jobs that share a scene, and one for those that share a renderer."""
        return self.key(OF_PICTURE), (self.key(CAMERA), self.which)

    def unpack(self, folder: Path) -> None:
        """Write the files into a folder."""
        for place, content in self.files.items():
            make_folder((folder / place).parent, place)
            replace_file(folder / place, content)

    def settings_in(self, folder: Path) -> RenderSettings:
        """The settings, with the paths of the files in this folder."""
        settings = dict(self.settings)
        for name in ("scene", "environment"):
            if settings.get(name) in self.files:
                settings[name] = str(folder / settings[name])
        settings["parts"] = tuple(str(folder / place) for place in settings.get("parts", ()))
        return RenderSettings(**settings)


def pack(settings: RenderSettings, paths: Iterable[str | Path], threads: int | None = None) -> Job:
    """The job of a picture, whose scene was loaded here.

    Args:
        paths: every file that was read while the scene was loaded. Shipped ones do not travel. Of the folders of the
            others, only those below the one that all of them share are named.
    """
    options = {name: value for name, value in settings.changed().items() if name not in STAYS}
    running = runtime.running_settings()
    options |= {"arch": running.arch, "precision": running.precision}
    places: dict[Path, str] = {}
    shipped = shipped_environments()
    if settings.environment not in (None, NO_NAME) and settings.environment not in shipped:
        path = absolute(settings.environment)
        places[path] = options["environment"] = f"environment/{path.name}"
    options["parts"] = []
    for i, path in enumerate(map(absolute, settings.parts)):
        options["parts"].append(f"parts/{i}/{path.name}")
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:  # a folder of the course
            places[file] = f"parts/{i}/{file.relative_to(path.parent).as_posix()}"
    if settings.scene not in shipped_scenes():
        options["scene"] = name_of(Path(settings.scene).expanduser().absolute())
    if options["scene"] not in shipped_scenes():
        file, known = absolute(settings.scene), {*places, *map(absolute, shipped.values())}
        of_scene = list(dict.fromkeys([file, *(path for path in map(absolute, paths) if path not in known)]))
        root = Path(os.path.commonpath([path.parent for path in of_scene]))
        places |= {path: f"scene/{path.relative_to(root).as_posix()}" for path in of_scene}
        options["scene"] = places[file]
    return Job(options, {place: read_bytes(path) for path, place in places.items()}, threads=threads)


def absolute(path: str | Path) -> Path:
    """The same file, wherever the program stands; links stay, because names in a scene begin beside the link."""
    return Path(os.path.abspath(Path(path).expanduser()))
