"""What is kept between runs, so that it need not be computed again: arrays in files of the user's cache."""

import contextlib
import io
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from taichi_tracer.files.disk import replace_file
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays

VARIABLE = "TAICHI_TRACER_CACHE"  # the environment variable that names another folder for what is kept between runs


def cache_folder() -> Path:
    """Where answers are kept: the folder in TAICHI_TRACER_CACHE, or one in the user's cache."""
    home = os.environ.get(VARIABLE)
    if home is None:
        home = str(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "taichi_tracer")
    return Path(home) / "teaching"


def keep_arrays(path: Path, arrays: Arrays) -> None:
    """Keep arrays in a file. A folder that cannot be written costs the time of the next run, and nothing else."""
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]
    with contextlib.suppress(OSError, InputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, file.getvalue())


def arrays_in(path: Path) -> Arrays | None:
    """The arrays that were kept; None if the file is missing or damaged."""
    try:
        with np.load(path, allow_pickle=False) as found:
            return {name: found[name] for name in found.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        return None


def joined(groups: Mapping[str, Arrays]) -> Arrays:
    """The arrays of several groups in one: "GROUP/NAME" → array."""
    return {f"{group}/{name}": array for group, arrays in groups.items() for name, array in arrays.items()}


def parted(arrays: Arrays) -> dict[str, Arrays]:
    """The groups that ``joined`` put together."""
    groups: dict[str, Arrays] = {}
    for key, array in arrays.items():
        group, _, name = key.rpartition("/")
        groups.setdefault(group, {})[name] = array
    return groups
