"""The widget of ``tt.show``. Only notebooks import this file, because anywidget need not be installed."""

import asyncio
import base64
import contextlib
from pathlib import Path
from typing import Any

import anywidget

from taichi_tracer.apps.page.channel import Watcher
from taichi_tracer.apps.page.session import Session
from taichi_tracer.progressive import ProgressiveRenderer

FOLDER = Path(__file__).parent
REST = 0.1  # seconds between two looks if no event comes: another cell may have changed the renderer


class LivePicture(anywidget.AnyWidget):
    """A view of a ``Session``; it sends frames as long as the page shows them.

    Args:
        renderer: what is shown. loop: of the notebook, in which the picture is rendered.
    """

    _esm = FOLDER / "live.js"
    _css = FOLDER / "live.css"

    def __init__(self, renderer: ProgressiveRenderer, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self.session = Session(renderer)
        self._watcher = Watcher(self.session, lambda state, data: self.send(state, [data]))
        self.session.watchers.append(self._watcher)
        self._awake = asyncio.Event()
        self.on_msg(self._take)
        self._task = loop.create_task(self._run())

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that shows."""
        return self.session.renderer

    def _take(self, _widget: Any, content: Any, _buffers: Any) -> None:
        with self.session.errors_as_message():
            self._watcher.post(content)
        self._awake.set()

    async def _run(self) -> None:
        """Render and send, until the picture is closed."""
        if self.renderer.film.samples == 0:  # warming up would discard samples
            self.session.warm_up()
        while self.comm is not None:
            if self.session.step(0.0):
                await asyncio.sleep(0)
                continue
            self._awake.clear()
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._awake.wait(), min(REST, self.session.seconds_of_rest()))

    def close(self) -> None:
        """End the picture."""
        self._task.cancel()
        super().close()

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The live picture; and the picture so far, which a saved notebook shows."""
        found = super()._repr_mimebundle_(**options)
        data = found[0] if isinstance(found, tuple) else found
        if data is not None and self.renderer.film.samples > 0:
            data["image/png"] = base64.b64encode(self.renderer._repr_png_()).decode()
        return found
