"""What a window shows until the student's methods are written: a checkerboard with their names."""

from functools import lru_cache
from typing import Any

import numpy as np

from taichi_tracer.system.own_code.checks import unwrap
from taichi_tracer.teaching.handout.stubs import is_stub

DARK, LIGHT = 70, 100  # the two greys, of 255
SQUARES = 8  # along the shorter side
TEXT_SHARE = 1 / 22  # the height of the letters, as a share of the shorter side
SMALLEST_TEXT = 9  # pixels
WIDTH_OF_A_LETTER = 0.6  # of its height


def marked(renderer: Any) -> Any:
    """Let a renderer show a checkerboard while a method that the picture needs is a stub. Returns the renderer.

    Args:
        renderer: a renderer whose camera, intersector, samplers or shading a student may have written.
    """
    take_sample = renderer.add_sample

    def add_sample(index: int, count: int = 1) -> None:
        names = missing(renderer)
        if names:
            size = renderer.width, renderer.height
            renderer.film.canvas.from_numpy(board(*size, tuple(names)))
        else:
            take_sample(index, count)

    renderer.add_sample = add_sample
    return renderer


def missing(renderer: Any) -> list[str]:
    """The stubs that the picture of a renderer needs, such as "Camera.generate_ray"."""
    scene = renderer.scene_data
    objects = [renderer.camera, renderer, renderer.active, scene.ray_intersector, scene.environment]
    objects += [getattr(renderer.active, "sampler", None), getattr(scene.lamps, "choice", None)]
    objects += [*getattr(scene, "lights", ()), *scene.material_library.brdfs]
    found: dict[str, None] = {}
    for one in objects:
        for cls in type(one).__mro__:
            if cls.__module__.startswith("taichi_tracer.") or cls.__module__ == "builtins":
                break
            for name, value in vars(cls).items():
                if is_shown(name, renderer):
                    found |= dict.fromkeys(stubs_behind(value, f"{cls.__name__}.{name}"))
    return list(found)


def stubs_behind(method: object, name: str) -> list[str]:
    """The name of a method if it is a stub; otherwise the stubs that it calls by the name of a class, as "BRDF.f"."""
    if is_stub(method):
        return [name]
    code, known = getattr(unwrap(method), "__code__", None), getattr(unwrap(method), "__globals__", {})
    names = code.co_names if code is not None else ()
    classes = [known[word] for word in names if isinstance(known.get(word), type)]
    called = [(cls, word) for cls in classes if not cls.__module__.startswith("taichi_tracer.") for word in names]
    return [f"{cls.__name__}.{word}" for cls, word in called if is_stub(vars(cls).get(word))]


def is_shown(method: str, renderer: Any) -> bool:
    """Whether a method decides what the renderer shows: of the methods of views, only that of the view in use does."""
    views = {f"shade_{integrator.name}" for integrator in renderer.offers}
    return method not in views or method == f"shade_{renderer.active.name}"


@lru_cache(maxsize=4)
def board(width: int, height: int, names: tuple[str, ...]) -> np.ndarray:
    """(width, height, 3) float32, indexed [x, y] with y up: a checkerboard, with a line for each name."""
    from PIL import Image, ImageDraw, ImageFont

    side = max(1, min(width, height) // SQUARES)
    x, y = np.meshgrid(np.arange(width) // side, np.arange(height) // side)
    grey = np.where((x + y) % 2 == 0, DARK, LIGHT).astype(np.uint8)
    image = Image.fromarray(np.repeat(grey[..., None], 3, axis=2))
    lines = ["not written yet:", *names]
    fitting = width / max(map(len, lines)) / WIDTH_OF_A_LETTER
    letters = max(SMALLEST_TEXT, round(min(min(width, height) * TEXT_SHARE, fitting)))
    place = {"font": ImageFont.load_default(letters), "anchor": "mm", "fill": (255, 220, 120)}
    ImageDraw.Draw(image).multiline_text((width / 2, height / 2), "\n".join(lines), **place)
    rows = np.asarray(image, np.float32) / 255
    return np.ascontiguousarray(rows[::-1].swapaxes(0, 1))
