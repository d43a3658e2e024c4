"""Files are written to another folder where theirs cannot be written, so that no result is lost; the user is told."""

import contextlib
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from taichi_tracer.files.disk import replace_file
from taichi_tracer.files.images import save_image
from taichi_tracer.system.errors import InputError


def written(path: Path, write: Callable[[Path], None], names: Sequence[str] = ()) -> Path:
    """The place that ``write(place)`` wrote: ``path``, or one in another folder where the disk is full, say.

    Args:
        names: other names to try in the other folders, for a format that cannot be written at all.

    Raises:
        InputError: no place could be written; it says what was wrong with ``path``.
    """
    try:
        write(path)
        return path
    except (InputError, OSError) as error:
        for name in (path.name, *names):
            for folder in other_folders():
                with contextlib.suppress(InputError, OSError):
                    write(folder / name)
                    print(f"taichi-tracer: error: {error}: it is in {folder / name} instead", file=sys.stderr)
                    return folder / name
                with contextlib.suppress(OSError):
                    folder.rmdir()
        raise


def other_folders() -> Iterator[Path]:
    """New folders, where there may be room: among temporary files, at home, and here."""
    for parent in (tempfile.gettempdir, Path.home, Path.cwd):
        with contextlib.suppress(OSError, RuntimeError):
            yield Path(tempfile.mkdtemp(prefix="taichi_tracer_", dir=parent()))


def written_picture(path: Path, image, channels: dict | None = None, **encoding) -> Path:
    """Where a picture was written; floating-point numbers that need no library are the last resort.

    Args:
        channels: those beside the picture, for a format that has a place for them.
        encoding: other arguments of ``save_image``.
    """

    def write(place: Path) -> None:
        save_image(place, image, channels=channels if place.suffix == path.suffix else None, **encoding)

    return written(path, write, [f"{path.stem}.pfm"])


def written_bytes(path: Path, content: bytes) -> Path:
    """Where a file was written."""
    return written(path, lambda place: replace_file(place, content))
