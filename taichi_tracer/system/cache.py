"""The cache: a writable folder in which Taichi keeps compiled kernels between runs, or none.

If Taichi cannot write its cache, it ends the process with a segmentation fault. This happens in containers, in computer
labs and in automatic graders. Therefore the folder is tested before Taichi starts.

While Taichi writes kernels, an empty file is its lock. If the process is killed meanwhile, the lock stays, and from
then on no process saves any kernel, without a word. Therefore a lock that is old is removed.
"""

import contextlib
import os
import stat
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from taichi.lang import impl

VARIABLE = "TI_OFFLINE_CACHE_FILE_PATH"  # the environment variable in which Taichi looks for the folder
LOCK = "ticache.lock"  # in the folder
TURNS = "taichi_tracer.lock"  # in the folder: held by the process of the package that writes its kernels
OLD = 60.0  # seconds: writing kernels takes less than one
TRIED_BYTES = 4096  # the size of the file that is written to test whether the disk has space


def wanted_folder() -> Path:
    """The folder that Taichi would choose: that of the environment variable, or its default in the user's home."""
    return Path(os.environ.get(VARIABLE) or impl.default_cfg().offline_cache_file_path)


def cache_folder(wanted: str | Path) -> tuple[Path | None, str | None]:
    """The folder for compiled kernels, and a message if it is not the wanted folder.

    Args:
        wanted: the folder that Taichi would choose.

    Returns:
        ``wanted`` if it is writable; otherwise None, which means that kernels are compiled again in every run.
    """
    problem = why_not_writable(Path(wanted))
    if problem is None:
        remove_old_lock(Path(wanted))
        return Path(wanted), None
    advice = f"kernels are compiled anew in every run, unless {VARIABLE} names another folder"
    return None, f"the cache of compiled kernels, {wanted}, cannot be written ({problem}): {advice}"


def remove_old_lock(folder: Path) -> None:
    """Remove the lock of a process that was killed while it wrote kernels."""
    lock = folder / LOCK
    with contextlib.suppress(OSError):  # there is none, or another process has just removed it
        if time.time() - lock.stat().st_mtime > OLD:
            lock.unlink()


@contextlib.contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Wait until no other process of the package writes kernels into a folder, and let them wait meanwhile.

    While another process writes, Taichi does not wait: it saves nothing. The lock ends with the process that holds it.
    On Windows, nobody waits.
    """
    with contextlib.ExitStack() as held:
        with contextlib.suppress(ImportError, OSError):  # Windows; a folder that is gone, or that has no locks
            import fcntl

            fcntl.flock(held.enter_context((folder / TURNS).open("w")), fcntl.LOCK_EX)
        yield


def why_not_writable(folder: Path) -> str | None:
    """The reason why no file can be written in a folder; None if it is writable. A missing folder is made."""
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=stat.S_IRWXU)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(TRIED_BYTES))
            file.flush()
    except OSError as error:
        return error.strerror or type(error).__name__
    return None
