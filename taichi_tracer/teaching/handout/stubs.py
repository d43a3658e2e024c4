"""What a stub calls until it is written, how the kit sees that, and the dark picture that names what is missing."""

import dis
import sys
from functools import cache
from typing import Any

from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.own_code.checks import unwrap
from taichi_tracer.system.parts import written

MARK = "not_written"  # the name of the function, as it stands in the code of a stub
OF_GRADERS = "NotImplementedError"  # nbgrader raises it where it has cut out a solution
DARK = 0.1  # the grey of a picture that cannot be made yet


@compile_time
def not_written(name: str) -> None:
    """Mark a method that a student has not written yet; kernels and Python may call it, and it does nothing.

    The checks, the grader and the window look for this call. They never run it to find out.

    Args:
        name: class and method, such as "Camera.generate_ray".
    """


def is_stub(method: object) -> bool:
    """Whether the code of a method calls ``not_written``, or raises a NotImplementedError.

    The method may be a Taichi function, a kernel or a static.
    """
    names = getattr(getattr(unwrap(method), "__code__", None), "co_names", ())
    return MARK in names or OF_GRADERS in names


def line_of_mark(stub: object) -> int:
    """The line in which a stub calls ``not_written``."""
    code = unwrap(stub).__code__
    mark = next(one.offset for one in dis.get_instructions(code) if one.argval in (MARK, OF_GRADERS))
    return next(line for first, end, line in code.co_lines() if first <= mark < end)


def is_placeholder(cls: type, name: str) -> bool:
    """Whether a method is still that of the base code: it reads none of its arguments, or it calls one that does so."""
    methods = {word: unwrap(written(cls, word)) for word in dir(cls)}
    called = set(methods[name].__code__.co_names) & set(methods) - {name}
    return any(reads_nothing(methods[word]) for word in (name, *called) if hasattr(methods[word], "__code__"))


def reads_nothing(function: object) -> bool:
    """Whether a function never uses its arguments, as ``pass`` and ``return tm.vec3(0)``."""
    code = function.__code__  # type: ignore[attr-defined]
    arguments = set(code.co_varnames[: code.co_argcount])
    used = (one.argval for one in dis.get_instructions(code) if one.opname.startswith("LOAD_"))
    return bool(arguments) and not any(
        arguments & set(value if isinstance(value, tuple) else (value,)) for value in used
    )


# ── a picture that needs them ──


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
