"""Where pictures go: a file, a folder, or several files, all known to be writable before any work is done."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from taichi_tracer.apps.render_request import RenderRequest
from taichi_tracer.apps.words import PICTURE_FOLDER, note
from taichi_tracer.files.disk import make_folder
from taichi_tracer.files.images import EIGHT_BITS, HAVE_CHANNELS, check_writable
from taichi_tracer.integrators.path_settings import name_of
from taichi_tracer.picture.aovs import channel_names
from taichi_tracer.system.errors import InputError
from taichi_tracer.tones.display import Display


@dataclass(frozen=True)
class Places:
    """Where the pictures of one view go.

    Attributes:
        pictures: one path, or one for each member of ``RenderRequest.bounces``.
        sheet: where a contact sheet of them goes, or None.
    """

    pictures: tuple[Path, ...]
    sheet: Path | None = None


def paths_of(request: RenderRequest) -> list[list[Places]]:
    """Where each view of each picture goes: where ``-o`` says, or the scene file; else into ``PICTURE_FOLDER``."""
    asked, output = request.pictures, request.output
    names = [(picture.filename, integrator.name) for picture in asked for _, integrator in picture.views]
    if output is None and all(filename is not None for filename, _ in names):
        paths = [Path(filename) for filename, _ in names]
        for path in paths:
            make_folder(path.parent, f"filename {path}")
    else:
        extension = HAVE_CHANNELS[0] if request.aovs else ".png"
        paths = output_paths(output, request.scene.name, [name for _, name in names], extension)
        if len(paths) > 1 or Path(output or PICTURE_FOLDER).is_dir():
            paths = [
                path.parent / Path(path.name if filename is None else filename).name
                for path, (filename, _) in zip(paths, names, strict=True)
            ]
    found = [places_of(path, request) for path in distinct(paths)]
    for places in found:
        for path in places.pictures:
            check_writable(path, channel_names(request.aovs))
        if places.sheet is not None:
            check_writable(places.sheet)
    following = iter(found)
    return [[next(following) for _ in picture.views] for picture in asked]


def places_of(path: Path, request: RenderRequest) -> Places:
    """The place of a view's picture; or of its pictures by bounce, which have the number after the name."""
    if not request.bounces:
        return Places((path,))
    pictures = tuple(path.with_stem(f"{path.stem}_bounce_{name_of(one)}") for one in request.bounces)
    if len(pictures) == 1:
        return Places((path,) if request.output is not None and Path(request.output) == path else pictures)
    return Places(pictures, path.with_name(f"{path.stem}_bounces.png"))


def distinct(paths: list[Path]) -> list[Path]:
    """The same paths, but a number after the name of each that an earlier one has."""
    free: list[Path] = []
    for path in paths:
        numbered, count = path, 1
        while numbered in free:
            count += 1
            numbered = path.with_stem(f"{path.stem}_{count}")
        free.append(numbered)
    return free


def output_paths(output: str | None, scene: str, names: list[str], extension: str = ".png") -> list[Path]:
    """Where each view goes, known to be writable before any work is done.

    Args:
        output: a file, a folder, or None for ``PICTURE_FOLDER``. Folders are made.
        scene: name or path of the scene: in a folder, files are called <scene>_<view><extension>.
        names: of the views.

    Raises:
        InputError: one file for several views, or a place that cannot be written.
    """
    folder = Path(PICTURE_FOLDER if output is None else output)
    is_folder = output is None or output.endswith(("/", "\\")) or folder.is_dir()
    if len(names) > 1 and not is_folder:
        if folder.suffix != "":
            raise InputError(f"-o {output} is one file for {len(names)} views: give a folder, such as renders/")
        is_folder = True
    paths = [folder]
    if is_folder:
        make_folder(folder, f"-o {output}")
        paths = [folder / f"{Path(scene).stem}_{name}{extension}" for name in names]
    for path in paths:
        check_writable(path)
    return paths


def note_linear(display: Display, paths: Sequence[Path]) -> None:
    """Tell the user which files keep linear values although an exposure or a tone curve was asked for."""
    linear = [str(path) for path in paths if path.suffix.lower() not in EIGHT_BITS]
    if linear and not display.is_plain:
        note(f"{', '.join(linear)}: linear, without {display}: these change only {' '.join(EIGHT_BITS)}")
