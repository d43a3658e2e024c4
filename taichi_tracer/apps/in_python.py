"""The lines of Python that make a picture again, with the same pixels."""

from inspect import signature
from typing import Any

import numpy as np

import taichi_tracer
from taichi_tracer.apps.requests import OF_LIGHT
from taichi_tracer.apps.same_again import changed_values, position_of
from taichi_tracer.integrators.rt3 import DepthMap
from taichi_tracer.integrators.rt3_blinn_phong import BlinnPhong
from taichi_tracer.lights.given import GivenLight
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.sampler import usual_sampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import load_scene_data, name_of
from taichi_tracer.scene_parts import intersector_of
from taichi_tracer.system import runtime
from taichi_tracer.system.registry import PARTS


def as_python(renderer: ProgressiveRenderer) -> str:
    """Lines of Python that make the picture that the renderer shows, of a scene that ``load_scene_data`` finds.

    What no text can say, such as a part that is an object of a program, is told in a comment.
    """
    scene, cls = renderer.scene_data, type(renderer)
    options = scene_options(scene)
    lines = ["import taichi_tracer as tt"]
    lines += ["from taichi_tracer.environment import load_environment"] * isinstance(options["environment"], Code)
    lines += [f"# {what} is an object of your own program: add it" for what in unnamed_parts(renderer)]
    precision = runtime.current().precision
    lines += ["", f"tt.init(precision={precision!r})"] if precision != default(runtime.init, "precision") else [""]
    name = f"tt.{cls.__name__}" if hasattr(taichi_tracer, cls.__name__) else cls.__name__
    lines.append(call("scene = tt.load_scene_data", [repr(str(name_of(scene.source)))], options))
    size = ["scene", str(renderer.width), str(renderer.height)]
    lines.append(call(f"renderer = {name}", size, renderer_options(renderer)))
    lines.append(call("renderer.camera.set_camera_parameters", [], position_of(renderer.camera)))
    lines += value_lines(renderer)
    lines.append(f"renderer.use({renderer.active.name!r}).render({max(1, renderer.samples)})")
    lines.append(f"renderer.save({renderer.active.name + '.png'!r})")
    return "\n".join(lines)


def scene_options(scene: SceneData) -> dict[str, Any]:
    """The arguments of ``load_scene_data`` that are not the defaults."""
    options: dict[str, Any] = {
        "intersector": None if scene.chosen is intersector_of(None, scene.mesh) else scene.chosen.name,
        "triangle_test": scene.ray_intersector.triangle_test,
        "effects": scene.effects_mode,
        "smooth": scene.smooth,
        "up_axis": scene.up_axis,
        "ground": scene.ground,
        "two_sided_lamps": scene.lamps.two_sided,
    }
    options = {name: value for name, value in options.items() if value != default(load_scene_data, name)}
    options["environment"] = environment_of(scene)
    if scene.lamps.count > 1:
        options["lamp_choice"] = scene.lamps.choice.name
    given = scene.lights[scene.lights_of_file :]
    if given:
        options["lights"] = [Code(light) if isinstance(light, GivenLight) else light.name for light in given]
    return options


def environment_of(scene: SceneData) -> Any:
    """The name of the environment; with its intensity, rotation and look-up where they are not the usual ones."""
    light = scene.environment
    if light is None:
        return None
    usual = {name: default(type(light), name) for name in OF_LIGHT}
    own = {name: getattr(light, name) for name in OF_LIGHT if getattr(light, name) != usual[name]}
    return light.name if not own else call("load_environment", [repr(light.name)], own)


def renderer_options(renderer: ProgressiveRenderer) -> dict[str, Any]:
    """The arguments of the renderer that are not the defaults."""
    crop = renderer.film.crop
    options: dict[str, Any] = {
        "camera": renderer.camera.name,
        "jitter": renderer.jitter if renderer.jitter != renderer.jitters else None,
        "sampler": None if renderer.sampler.name == usual_sampler(bool(renderer.adaptive)) else renderer.sampler.name,
        "seed": renderer.seed,
        "first_sample": renderer.first_sample,
        "crop": None if crop == (0, renderer.width, 0, renderer.height) else crop,
        "adaptive": renderer.adaptive,
    }
    found = {n: value for n, value in options.items() if value != default(ProgressiveRenderer, n)}
    return found if found.get("camera") != "perspective" else {n: v for n, v in found.items() if n != "camera"}


def value_lines(renderer: ProgressiveRenderer) -> list[str]:
    """What is changed of the renderer after it is made: values of the integrator, and how the picture is shown."""
    active = renderer.active
    lines = []
    for name, value in changed_values(renderer).items():
        is_attribute, text = hasattr(type(renderer), name), plain(value)
        lines.append(f"renderer.{name} = {text}" if is_attribute else f"renderer.change({name!r}, {text})")
    if isinstance(active, BlinnPhong) and active.depth != BlinnPhong().depth:
        lines.append(call("renderer.set_mirrors", [repr(int(active.depth))], {}))
    if isinstance(active, DepthMap):
        lines.append(call("renderer.set_depth", [], active.arguments()))
    if renderer.srgb and not renderer.has_own_display and not renderer.display.is_plain:
        shown = {"exposure": float(renderer.display.exposure), "tone": renderer.display.part.name}
        lines.append(call("renderer.set_display", [], shown))
    return lines


def unnamed_parts(renderer: ProgressiveRenderer) -> list[str]:
    """What the picture is made of and no name leads to."""
    scene = renderer.scene_data
    parts = [scene.ray_intersector, renderer.camera, renderer.sampler, renderer.active, *scene.lights]
    parts = [p for p in parts if p.kind != "intersector" or not hasattr(p, "stands_in_for")]
    names = [f"the {p.kind} {p.name or type(p).__name__!r}" for p in parts if not is_known(p)]
    if scene.background is not None and not str(scene.source).endswith(".xml"):
        names.append("the background")
    return names


def is_known(part: Any) -> bool:
    """Whether a part can be named in any program: it comes with the package, and so does its class."""
    return PARTS.comes_with_package(part) and type(part).__module__.startswith("taichi_tracer.")


class Code(str):
    """Text that is an expression of Python already."""


def call(function: str, arguments: list[str], options: dict[str, Any]) -> Code:
    """A call, as Python writes it."""
    named = [f"{name}={plain(value)}" for name, value in options.items()]
    return Code(f"{function}({', '.join([*arguments, *named])})")


def plain(value: Any) -> str:
    """A value as Python writes it, arrays as tuples."""
    if isinstance(value, Code):
        return str(value)
    if isinstance(value, list):
        return f"[{', '.join(map(plain, value))}]"
    if isinstance(value, np.ndarray):
        return repr(tuple(value.tolist()))
    return repr(value.item() if isinstance(value, np.generic) else value)


def default(function: Any, name: str) -> Any:
    """The default of a parameter."""
    return signature(function).parameters[name].default
