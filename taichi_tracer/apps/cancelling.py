"""A choice that has to be compiled can be cancelled: then what was shown before is shown again.

While Taichi translates a kernel, no other thread runs. So a choice ends between two kernels: at the latest when the one
that is translated is ready. It is kept, so that the next time is quicker.
"""

import contextlib
from collections.abc import Iterator
from typing import Any

from taichi_tracer.system import compiling


class Cancelled(BaseException):
    """Somebody does not want any more what is being compiled; no ``Exception``, which others might swallow."""


class Cancelling:
    """Ends what is compiled within ``while_compiling``, before the next kernel is translated.

    Args:
        session: its ``is_cancelled`` says whether somebody has asked for that.
    """

    def __init__(self, session: Any) -> None:
        self.session = session

    def begins(self, kernel: compiling.Kernel) -> None:
        """End the choice if nobody wants it any more."""
        if self.session.is_cancelled:
            raise Cancelled

    def ends(self) -> None:
        """The kernel is translated."""

    @contextlib.contextmanager
    def while_compiling(self) -> Iterator[None]:
        """Watch the kernels that are compiled within."""
        compiling.watchers.append(self)
        try:
            yield
        finally:
            compiling.watchers.remove(self)
            self.session.is_cancelled = False


def former(session: Any, kind: str, members: dict[str, Any]) -> tuple[str, dict[str, Any]] | None:
    """The event that takes a choice back; None where nothing is to be taken back."""
    renderer = session.renderer
    if kind == "use":
        return kind, {"what": renderer.what, "name": renderer.active.name}
    if kind in ("environment", "triangle_test", "lamp_choice", "ground"):
        return kind, {"name": getattr(session.choices, kind)}
    if kind == "split":
        return kind, {"mode": "off" if session.split is None else session.split.mode}
    control = next((one for one in renderer.controls() if kind == "control" and one.name == members["name"]), None)
    return None if control is None else (kind, {"name": control.name, "value": control.value})
