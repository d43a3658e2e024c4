"""``tt.show``: a picture in a notebook that is rendered while it is watched, by the same module as in a browser."""

import asyncio
from importlib.util import find_spec
from typing import Any

from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.renderer import A1Renderer, A3Renderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.system.errors import InputError

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
    if find_spec("anywidget") is None:
        raise InputError(MISSING)
    from taichi_tracer.apps.page.live_picture import LivePicture

    if isinstance(what, SceneData):
        if not what.effects.is_lit:
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

    return LivePicture(renderer, loop)
