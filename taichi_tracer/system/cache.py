"""Where Taichi keeps compiled kernels between runs: a folder that can be written, or none.

Taichi ends the process with a segmentation fault when it cannot write its cache, which happens in containers, in
computer labs and in graders. So the folder is tried before Taichi starts.
"""

import os
import stat
import tempfile
from pathlib import Path

TRIED_BYTES = 4096  # what is written to see whether the disk has room


def cache_folder(wanted: str | Path) -> tuple[Path | None, str | None]:
    """The folder for compiled kernels, and a message where it is not the wanted one.

    Args:
        wanted: Taichi's own choice.

    Returns:
        ``wanted`` when it can be written; else a folder of this user under the temporary folder; else None, which means
        that kernels are compiled anew in every run.
    """
    problem = why_not_writable(Path(wanted))
    if problem is None:
        return Path(wanted), None
    other = Path(tempfile.gettempdir()) / f"taichi_tracer_cache_{user_number()}"
    told = f"the cache of compiled kernels, {wanted}, cannot be written ({problem})"
    if why_not_writable(other) is None and is_of_this_user(other):
        return other, f"{told}: {other} is used instead"
    return None, f"{told}: kernels are compiled anew in every run"


def why_not_writable(folder: Path) -> str | None:
    """None when files can be made in a folder, which is made where it is missing; else the reason."""
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=stat.S_IRWXU)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(TRIED_BYTES))
            file.flush()
    except OSError as error:
        return error.strerror or type(error).__name__
    return None


def user_number() -> int:
    """The number of the user who runs this process; 0 on systems without such numbers."""
    return os.getuid() if hasattr(os, "getuid") else 0


def is_of_this_user(folder: Path) -> bool:
    """Whether a folder belongs to this user and is no link: others could put kernels of their own into it."""
    facts = folder.lstat()
    return stat.S_ISDIR(facts.st_mode) and (not hasattr(os, "getuid") or facts.st_uid == os.getuid())
