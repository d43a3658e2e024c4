"""What a picture is until the student's methods are written: dark, and a line in the terminal names them."""

import sys
from functools import cache
from typing import Any

from taichi_tracer.system.own_code.checks import unwrap
from taichi_tracer.teaching.handout.stubs import is_stub

DARK = 0.1  # the grey of the picture


def marked(renderer: Any) -> Any:
    """Let a renderer show a dark picture while a method that it needs is a stub. Returns the renderer.

    Args:
        renderer: a renderer whose camera, intersector, samplers or shading a student may have written.
    """
    take_sample = renderer.add_sample

    def add_sample(index: int, count: int = 1) -> None:
        names = missing(renderer)
        if names:
            renderer.film.canvas.fill(DARK)
            note(tuple(names))
        else:
            take_sample(index, count)

    renderer.add_sample = add_sample
    return renderer


def missing(renderer: Any) -> list[str]:
    """The stubs that the picture of a renderer needs, such as "Camera.generate_ray"."""
    scene = renderer.scene_data
    chosen = getattr(renderer.active, "sampler", None), getattr(scene.lamps, "choice", None)
    parts = renderer.camera, renderer, renderer.active, scene.ray_intersector, scene.environment, *chosen
    found: dict[str, None] = {}
    for one in (*parts, *getattr(scene, "lights", ()), *scene.material_library.brdfs):
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


@cache
def note(names: tuple[str, ...]) -> None:
    """Print which methods are missing, once."""
    print(f"The picture is dark, because these are not written yet: {', '.join(names)}", file=sys.stderr, flush=True)
