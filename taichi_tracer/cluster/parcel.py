"""What travels to a worker: the options of a command line as JSON, and the files that they name, by their content.

A path of the sender never travels. In the options, a file is named by its place within the parcel, such as
``scene/box.obj``; a shipped scene or environment keeps its name, because every worker has the same package. The worker
writes the files into a folder of its own.
"""

import hashlib
import json
import os
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from taichi_tracer.apps.options import add_display_options, add_picture_options
from taichi_tracer.files.disk import make_folder, read_bytes, replace_file
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.scene_data_loader import name_of, shipped_scenes
from taichi_tracer.system.errors import InputError

# What only the sender needs: where things are written, when the picture is good enough, and the command itself.
STAYS = {"command", "started", "helper", "begin", "debug", "cluster", "output", "checkpoint", "checkpoint_every", "aov"}
STAYS |= {"spp", "time", "error", "bounces", "report", "budget", "seeds", "frames", "degrees", "fps"}
CAMERA = {"eye", "at", "up", "fov"}  # pictures that differ only in these share a renderer on a worker
CHUNK = 32 << 20  # bytes: a large file travels in pieces, between which a worker can say that it is alive


def names_of_picture() -> set[str]:
    """The options of a picture, beside those of its scene: pictures that differ only in these share a scene."""
    parser = ArgumentParser()
    add_picture_options(parser)
    add_display_options(parser)
    return {*vars(parser.parse_args([])), "view_option"}


PICTURE = names_of_picture()


@dataclass(frozen=True)
class Parcel:
    """A scene and its options, ready to travel.

    Attributes:
        options: the namespace of the command line, as JSON; files are named by their places.
        files: (place, hashes of the pieces of its content) of every file.
        sources: (hash, path, offset) of every piece, at the sender only.
    """

    options: str
    files: tuple[tuple[str, tuple[str, ...]], ...]
    sources: tuple[tuple[str, Path, int], ...] = ()

    @property
    def id(self) -> str:
        """A name for the parcel: equal for equal options and contents."""
        return hashlib.sha256(json.dumps([self.options, self.files]).encode()).hexdigest()[:32]

    @property
    def hashes(self) -> tuple[str, ...]:
        """The hashes of all pieces, in the order of ``files``; a content that stands in two places has one hash."""
        return tuple(dict.fromkeys(one for _, pieces in self.files for one in pieces))

    def message(self) -> dict:
        """What a worker gets beside the pieces."""
        return {"id": self.id, "options": self.options, "files": [[place, list(h)] for place, h in self.files]}

    def content(self, wanted: str) -> bytes:
        """The piece with this hash, read from the sender's disk.

        Raises:
            InputError: the file has changed since.
        """
        path, offset = next((path, offset) for one, path, offset in self.sources if one == wanted)
        with open(path, "rb") as file:
            file.seek(offset)
            piece = file.read(CHUNK)
        if hash_of(piece) != wanted:
            raise InputError(f"{path}: has changed since the rendering began: start again")
        return piece


def name_of_files(message: dict) -> str:
    """A name for the files of a parcel: equal for equal files in the same places."""
    return hashlib.sha256(json.dumps(message["files"]).encode()).hexdigest()[:32]


def without(message: dict, names: set[str]) -> str:
    """The options of a parcel, as JSON, without some of them."""
    options = json.loads(message["options"])
    return json.dumps({name: value for name, value in options.items() if name not in names}, sort_keys=True)


def hash_of(content: bytes) -> str:
    """The hash by which a content is named."""
    return hashlib.sha256(content).hexdigest()


def pack(args: Namespace, paths: Iterable[str | Path]) -> Parcel:
    """The parcel of a command line.

    Args:
        paths: every file that was read while the scene was loaded, that of ``--environment`` included. Shipped ones
            do not travel. Of the folders of the others, only those below the one that all of them share are named.
    """
    options = {name: value for name, value in vars(args).items() if name not in STAYS}
    places: dict[Path, str] = {}
    environment = args.environment
    if environment not in (None, "none") and environment not in shipped_environments():
        path = absolute(environment)
        places[path] = options["environment"] = f"environment/{path.name}"
    parts = [absolute(path) for path in args.parts]
    options["parts"] = [f"parts/{i}/{path.name}" for i, path in enumerate(parts)]
    places |= dict(zip(parts, options["parts"], strict=True))
    scene = args.scene if args.scene in shipped_scenes() else name_of(Path(args.scene).expanduser().absolute())
    options["scene"] = scene
    if scene not in shipped_scenes():
        file = absolute(args.scene)
        known = {*places, *map(absolute, shipped_environments().values())}
        others = (p for p in map(absolute, paths) if p not in known)
        of_scene = list(dict.fromkeys([file, *others]))
        root = Path(os.path.commonpath([path.parent for path in of_scene]))
        places |= {path: f"scene/{path.relative_to(root).as_posix()}" for path in of_scene}
        options["scene"] = places[file]
    sources = [(place, path, pieces_of(path)) for path, place in places.items()]
    files = tuple((place, tuple(one for one, _ in pieces)) for place, _, pieces in sources)
    found = {one: (one, path, offset) for _, path, pieces in sources for one, offset in pieces}
    return Parcel(json.dumps(options, sort_keys=True), files, tuple(found.values()))


def absolute(path: str | Path) -> Path:
    """The same file, wherever the program stands; links stay, because names in a scene begin beside the link."""
    return Path(os.path.abspath(Path(path).expanduser()))


def pieces_of(path: Path) -> list[tuple[str, int]]:
    """(hash, offset) of each piece of a file."""
    content = memoryview(read_bytes(path))
    return [(hash_of(content[at : at + CHUNK]), at) for at in range(0, max(1, len(content)), CHUNK)]


def unpack(message: dict, pieces: Mapping[str, bytes], folder: Path) -> Namespace:
    """Write the files of a parcel into a folder; returns the options, in which they have their paths there.

    Raises:
        InputError: a place leads out of the folder, a piece has another content, or the disk is full.
    """
    for place, hashes in message["files"]:
        check_place(place)
        content = b"".join(pieces[one] for one in hashes)
        if [hash_of(pieces[one]) for one in hashes] != list(hashes):
            raise InputError(f"{place}: what came is not what was sent: send it again")
        make_folder((folder / place).parent, place)
        replace_file(folder / place, content)
    options = {name: as_tuple(value) for name, value in json.loads(message["options"]).items()}
    places = {place for place, _ in message["files"]}
    for name in ("scene", "environment"):
        if options.get(name) in places:
            options[name] = str(folder / options[name])
    options["parts"] = [str(folder / place) for place in options["parts"] if place in places]
    return Namespace(**options, spp=None, time=None, error=None)


def as_tuple(value: object) -> object:
    """Lists, which JSON makes of tuples, as tuples again."""
    return tuple(map(as_tuple, value)) if isinstance(value, list) else value


def check_place(place: str) -> None:
    """Raise an InputError for a place that could lie outside the worker's folder."""
    path = PurePosixPath(place)
    strange = set(place) & set("\\:\0")
    if path.is_absolute() or strange or not path.parts or ".." in path.parts or str(path) != place:
        raise InputError(f"{place!r}: this place does not lie within the worker's folder")
