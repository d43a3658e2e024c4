"""Text for the clipboard of the desktop, by the programs that systems have for it; ``ti.ui`` cannot write to it."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator

PATIENCE = 2.0  # seconds; a program that takes longer waits for a desktop that does not answer


def commands() -> Iterator[list[str]]:
    """The commands of this system that take the new content of the clipboard from their input."""
    if sys.platform == "darwin":
        yield ["pbcopy"]
    elif sys.platform == "win32":
        yield ["clip"]
    else:
        if os.environ.get("WAYLAND_DISPLAY", "") != "":
            yield ["wl-copy"]
        if os.environ.get("DISPLAY", "") != "":
            yield ["xclip", "-selection", "clipboard"]
            yield ["xsel", "--clipboard", "--input"]


def copy(text: str) -> bool:
    """Write ``text`` to the clipboard; False if there is none, or no program that can write to it."""
    for command in commands():
        if shutil.which(command[0]) is not None:
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            try:
                subprocess.run(command, input=text.encode(), check=True, timeout=PATIENCE, **quiet)
            except (OSError, subprocess.SubprocessError):
                continue
            return True
    return False
