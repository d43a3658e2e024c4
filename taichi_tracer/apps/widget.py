"""``tt.show``: a picture in a notebook that is rendered while it is watched, by the same module as in a browser."""

import asyncio
import json
from pathlib import Path
from typing import Any

from taichi_tracer.apps.session import Session
from taichi_tracer.renderer import A1Renderer, A3Renderer, ProgressiveRenderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system.errors import InputError

FOLDER = Path(__file__).with_name("live")
IN_FLIGHT = 2  # frames that were sent and not yet shown: with more, a slow connection would fall behind
REST = 0.02  # seconds between two looks if there is nothing to do
SIZE = 512  # pixels, of a picture of a scene
MISSING = "show needs anywidget, which lets a notebook show a live picture: pip install 'taichi_tracer[notebook]'"


def show(what: SceneData | ProgressiveRenderer, width: int = SIZE, height: int = SIZE) -> Any:
    """A live picture for a notebook: drag it, choose views and estimators, explain pixels.

    The picture is rendered while it is in view and no other cell runs. A saved notebook keeps the last picture.

    Args:
        what: a renderer; or a scene, which is shown by its normals, or by its light if it has some.
        width, height: of the picture of a scene, in pixels.

    Raises:
        InputError: ``what`` is neither, or anywidget is not installed.
    """
    try:
        import anywidget
    except ImportError:
        raise InputError(MISSING) from None
    if isinstance(what, SceneData):
        if what.effects.is_dark:
            renderer: ProgressiveRenderer = A1Renderer(what, width, height).use("normal")
        else:
            renderer = A3Renderer(what, width, height).use("mis")
    elif isinstance(what, ProgressiveRenderer):
        renderer = what
    else:
        raise InputError(f"show takes a scene or a renderer, not {what!r}")
    renderer.scene_data.check_alive()
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:
        raise InputError("show needs a notebook whose kernel is running") from None

    class LivePicture(anywidget.AnyWidget):
        """A view of a ``Session``; it sends frames as long as the page shows them."""

        _esm = FOLDER / "live.js"
        _css = FOLDER / "live.css"

        def __init__(self) -> None:
            super().__init__()
            self.session = Session(renderer)
            self._sent = self._shown = 0
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
            if content["type"] == "ack":
                self._shown = max(self._shown, min(content["id"], self._sent))
                if content["id"] == 0:  # a page has opened, perhaps again: it has no frame yet
                    self._shown = self._sent
                    self.session.send_again()
            self.session.watch()

        async def _run(self) -> None:
            while self.comm is not None:
                worked = self.session.step(0.0)
                frame = self.session.newest(self._sent)
                if frame is not None and self._sent - self._shown < IN_FLIGHT:
                    self.send(json.loads(frame.state) | {"id": frame.number, "kind": frame.kind}, [frame.data])
                    self._sent = frame.number
                await asyncio.sleep(0 if worked else REST)

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
                import base64

                data["image/png"] = base64.b64encode(self.renderer._repr_png_()).decode()
            return found

    return LivePicture()
