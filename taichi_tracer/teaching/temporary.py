"""Temporary folders, which do not stay even if the process that made them is ended by force.

The folders of a process lie in one folder with a file that the process has locked. The system frees the lock when the
process ends, in whatever way. The next process that makes a temporary folder removes those whose lock is free.
"""

import atexit
import contextlib
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: what a process leaves behind when it is ended by force stays
    fcntl = None  # type: ignore[assignment]

PREFIX, LOCK = "taichi_tracer_of_", "lock"


def folder(kind: str) -> Path:
    """A new folder, which is removed when this process ends, if it is still there."""
    return Path(tempfile.mkdtemp(prefix=f"{kind}_", dir=home(os.getpid())))


@cache
def home(process: int) -> Path:
    """The folder with all temporary folders of a process. What others have left behind is removed first."""
    parent = Path(tempfile.gettempdir())
    remove_left(parent)
    made = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
    made.chmod(0o711)  # a submission that runs as a user of its own has to pass it
    if fcntl is not None:
        fcntl.flock(os.open(made / "new", os.O_RDWR | os.O_CREAT, 0o600), fcntl.LOCK_EX)  # open until the process ends
        (made / "new").rename(made / LOCK)  # so that no one sees the file before it is locked
    atexit.register(remove_own, made, process)
    return made


def remove_own(made: Path, process: int) -> None:
    """Remove the folder of a process in its end; a copy of the process, made by ``fork``, leaves it."""
    if os.getpid() == process:
        remove(made)


def remove_left(parent: Path) -> None:
    """Remove the folders of processes that have ended, if they belong to this user."""
    for left in parent.glob(f"{PREFIX}*") if fcntl is not None else ():
        with contextlib.suppress(OSError):
            if left.is_symlink() or left.stat().st_uid != os.geteuid():
                continue
            descriptor = os.open(left / LOCK, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)  # a BlockingIOError while its process lives
                remove(left)
            finally:
                os.close(descriptor)


def remove(path: str | Path) -> None:
    """Remove a folder, even if its folders were made unreadable."""
    for place, folders, _ in os.walk(path):
        for name in folders:
            inner = os.path.join(place, name)
            if not os.path.islink(inner):
                with contextlib.suppress(OSError):
                    os.chmod(inner, 0o700)
    shutil.rmtree(path, ignore_errors=True)
