"""The widget of ``tt.show``. Only notebooks import this file, because anywidget need not be installed."""

import asyncio
import base64
import contextlib
import json
from pathlib import Path
from typing import Any

import anywidget

from taichi_tracer.apps.page.session import Session
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.system.errors import InputError

FOLDER = Path(__file__).parent
IN_FLIGHT = 2  # frames that were sent and not yet shown: with more, a slow connection would fall behind
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
        self._sent = self._shown = self._details = 0
        self._awake = asyncio.Event()
        self.on_msg(self._take)
        self._task = loop.create_task(self._run())

    @property
    def renderer(self) -> ProgressiveRenderer:
        """The renderer that shows."""
        return self.session.renderer

    def _take(self, _widget: Any, content: Any, _buffers: Any) -> None:
        try:
            self.session.post(content)
        except InputError as error:
            self.session.message = str(error)
            return
        self.session.watch()
        self._awake.set()
        if content["type"] == "ack":
            self._shown = max(self._shown, min(content["id"], self._sent))
            if content["id"] == 0:  # a page has opened, perhaps again: it has no frame yet
                self._shown = self._sent
                self._details = 0
                self.session.send_again()
        elif content["type"] == "save":
            self._save(content["kind"])

    def _save(self, kind: str) -> None:
        """Send the picture as a file."""
        try:
            self.send({"file": f"picture.{kind}"}, [self.session.file(kind)])
        except InputError as error:
            self.session.message = str(error)

    async def _run(self) -> None:
        """Render and send, until the picture is closed."""
        if self.renderer.film.samples == 0:  # warming up would discard samples
            self.session.warm_up(lambda text: None)
        while self.comm is not None:
            if self._sent - self._shown < IN_FLIGHT:
                self.session.ask()
            worked = self.session.step(0.0)
            frame = self.session.newest(self._sent)
            if frame is not None and self._sent - self._shown < IN_FLIGHT:
                details = json.loads(frame.details) if frame.details_number != self._details else {}
                content = json.loads(frame.state) | details | {"id": frame.number, "kind": frame.kind}
                self.send(content, [frame.data_after(self._sent)])
                self._sent, self._details = frame.number, frame.details_number
            if worked:
                await asyncio.sleep(0)
                continue
            self._awake.clear()
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._awake.wait(), min(REST, self.session.seconds_of_rest()))

    def close(self) -> None:
        """End the picture."""
        self._task.cancel()
        self.session.close()
        super().close()

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The live picture; and the picture so far, which a saved notebook shows."""
        found = super()._repr_mimebundle_(**options)
        data = found[0] if isinstance(found, tuple) else found
        if data is not None and self.renderer.film.samples > 0:
            data["image/png"] = base64.b64encode(self.renderer._repr_png_()).decode()
        return found
