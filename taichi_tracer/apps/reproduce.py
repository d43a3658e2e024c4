"""What makes a picture again that is shown: its settings, the command line, and the lines of Python."""

import shlex
from dataclasses import replace
from inspect import signature
from typing import Any

import numpy as np

import taichi_tracer
from taichi_tracer.apps.pictures import OF_LIGHT, RENDERER_ARGUMENTS, SCENE_ARGUMENTS
from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.integrators.rt3 import DepthMap
from taichi_tracer.integrators.rt3_blinn_phong import BlinnPhong
from taichi_tracer.lights.given import GivenLight
from taichi_tracer.options import intersector_of
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.sampler import usual_sampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import name_of
from taichi_tracer.settings import NO_NAME, OPTIONS, SMOOTH, RenderSettings, words_of
from taichi_tracer.system import runtime
from taichi_tracer.system.parts import PARTS


def as_command(renderer: ProgressiveRenderer, base: RenderSettings | None = None) -> str:
    """The command line that makes the picture that the renderer shows; ``base`` as for ``settings_of``."""
    settings = settings_of(renderer, base)
    if not renderer.needs_light:
        settings = replace(settings, environment=None, lamp_choice=None)
    return shlex.join(["taichi-tracer", "render", settings.scene, *settings.words()])


def settings_of(renderer: ProgressiveRenderer, base: RenderSettings | None = None) -> RenderSettings:
    """The settings of the picture that a renderer shows.

    Args:
        base: what the program was started with; it has what no renderer knows, such as the files of ``--parts``.
    """
    film, sampler = renderer.film, renderer.sampler.name
    values = {name: changed_values(renderer).get(one.value) for name, one in OPTIONS.items() if one.value}
    is_shown = renderer.srgb and not renderer.has_own_display
    return replace(
        scene_settings(renderer.scene_data, base or RenderSettings()),
        **values | {"bounces": () if values["bounces"] is None else (values["bounces"],)},
        **camera_settings(renderer.camera),
        environment=environment_name(renderer.scene_data),
        view=renderer.active.name,
        size=(renderer.width, renderer.height),
        quick=False,
        crop=fractions_of(film.crop, renderer.width, renderer.height),
        sampler=None if sampler == usual_sampler(bool(renderer.adaptive)) else sampler,
        seed=renderer.seed,
        first_sample=renderer.first_sample,
        jitter=renderer.jitter and not renderer.jitters,
        adaptive=renderer.adaptive,
        spp=renderer.samples if renderer.is_random and renderer.samples > 0 else None,
        time=None,
        error=None,
        exposure=float(renderer.display.exposure) if is_shown else 0.0,
        tone=renderer.display.part.name if is_shown else "none",
    )


def scene_settings(scene: SceneData, base: RenderSettings) -> RenderSettings:
    """The settings of a scene."""
    light, given = scene.environment, scene.lights[scene.lights_of_file :]
    name = name_of(scene.source)
    is_usual = name != str(scene.source) and scene.up_axis == "y"  # what a shipped scene says itself
    own_test = scene.ray_intersector.triangle_test
    return replace(
        base,
        scene=name,
        up_axis=None if is_usual else scene.up_axis,
        lights=tuple(one.name for one in given if not isinstance(one, GivenLight)),
        intersector=None if scene.chosen is intersector_of(None, scene.mesh) else scene.chosen.name,
        triangle_test=own_test if own_test in PARTS.names("triangle test") and own_test != "watertight" else None,
        lamp_choice=scene.lamps.choice.name if scene.lamps.count > 1 else None,
        two_sided_lamps=scene.lamps.two_sided,
        effects=None if scene.effects_mode == "scene" else scene.effects_mode,
        smooth=SMOOTH if scene.given["smooth"] is True else scene.given["smooth"] or None,
        ground=scene.ground,
        precision=None if runtime.current().precision == "f32" else runtime.current().precision,
        **{name: getattr(light, name) for name in OF_LIGHT if light is not None and is_changed(light, name)},
    )


def environment_name(scene: SceneData) -> str:
    """The name of the light from far away, or "none"."""
    return NO_NAME if scene.environment is None else scene.environment.name


def is_changed(part: Any, name: str) -> bool:
    """Whether an argument of a part is not the default."""
    return getattr(part, name) != signature(type(part)).parameters[name].default


def fractions_of(crop: tuple[int, int, int, int], width: int, height: int) -> tuple[float, ...] | None:
    """The crop window that has exactly these pixels; None for the whole picture."""
    if crop == (0, width, 0, height):
        return None
    sides = zip(crop, (width, width, height, height), strict=True)
    return tuple(0.0 if edge == 0 else 1.0 if edge == side else (edge - 0.5) / side for edge, side in sides)


def changed_values(renderer: ProgressiveRenderer) -> dict[str, Any]:
    """The values of a renderer that are not the defaults, and that the picture in use may depend on."""
    known, active = {one.value: one for one in OPTIONS.values() if one.value}, renderer.active.name
    values = ((known[name], value) for name, value in renderer.values().items() if name in known)
    return {of.value: value for of, value in values if value != of.usual and of.of in ("", active)}


def name_of_light(renderer: ProgressiveRenderer) -> str:
    """The name of the bounces whose light is shown, as ``--bounces`` takes it; "" if all of it is shown."""
    bounces = renderer.values().get("bounces")
    return "" if bounces is None else words_of("bounces", (bounces,))[1]


def camera_settings(camera: ProjectiveCamera) -> dict[str, Any]:
    """The settings of a camera, to nine digits; its window at distance 1, or in world units if it is orthographic."""
    scale = 1.0 if isinstance(camera, OrthographicCamera) or not camera.has_window else camera.focal_distance
    window = rounded(np.divide(camera.screen_window, scale)) if camera.has_window else None
    return {
        **{name: rounded(getattr(camera, name)) for name in ("eye", "at", "up")},
        "camera": camera.name,
        "window": window,
        "fov": None if camera.has_window else rounded([camera.fov])[0],
        "handedness": camera.handedness,
    }


def rounded(values: Any) -> tuple[float, ...]:
    """Numbers to nine digits, without a negative zero."""
    return tuple(float(f"{value:.9g}") + 0.0 for value in values)


def camera_words(camera: ProjectiveCamera) -> list[str]:
    """The options that make a camera again."""
    given = {name: value for name, value in camera_settings(camera).items() if value is not None}
    return [word for name, value in given.items() for word in words_of(name, value)]


def position_of(camera: ProjectiveCamera) -> dict:
    """The arguments of ``set_camera_parameters`` that bring the camera back to where it is."""
    position = {name: getattr(camera, name) for name in ("eye", "at", "up", "handedness")}
    return position | ({"screen_window": camera.screen_window} if camera.has_window else {"fov": camera.fov})


# ── as Python ──


def as_python(renderer: ProgressiveRenderer) -> str:
    """Lines of Python that make the picture that the renderer shows, of a scene that ``load_scene_data`` finds.

    Parts that are objects of a program of your own, and a background, are left out.
    """
    scene, cls, settings = renderer.scene_data, type(renderer), settings_of(renderer)
    options = settings.changed()
    of_scene = {name: options[name] for name in SCENE_ARGUMENTS if name in options}
    own = {name: options[name] for name in OF_LIGHT if name in options}
    light = repr(scene.environment and scene.environment.name)
    of_scene["environment"] = Code(light if not own else call("load_environment", [light], own))
    if given := scene.lights[scene.lights_of_file :]:
        of_scene["lights"] = [Code(one) if isinstance(one, GivenLight) else one.name for one in given]
    of_renderer = {name: options[name] for name in (*RENDERER_ARGUMENTS, "jitter") if name in options}
    if "crop" in options:
        of_renderer["crop"] = renderer.film.crop
    if renderer.camera.name != "perspective":
        of_renderer["camera"] = renderer.camera.name
    lines = ["import taichi_tracer as tt"]
    lines += ["from taichi_tracer.environment import load_environment"] * bool(own)
    lines += ["", f"tt.init(precision={settings.precision!r})"] if settings.precision else [""]
    name = f"tt.{cls.__name__}" if hasattr(taichi_tracer, cls.__name__) else cls.__name__
    lines.append(call("scene = tt.load_scene_data", [repr(settings.scene)], of_scene))
    size = ["scene", str(renderer.width), str(renderer.height)]
    lines.append(call(f"renderer = {name}", size, of_renderer))
    lines.append(call("renderer.camera.set_camera_parameters", [], position_of(renderer.camera)))
    lines += value_lines(renderer)
    if "exposure" in options or "tone" in options:
        lines.append(call("renderer.set_display", [], {"exposure": settings.exposure, "tone": settings.tone}))
    lines.append(f"renderer.use({renderer.active.name!r}).render({max(1, renderer.samples)})")
    lines.append(f"renderer.save({renderer.active.name + '.png'!r})")
    return "\n".join(lines)


def value_lines(renderer: ProgressiveRenderer) -> list[str]:
    """The values of the integrator that are changed after the renderer is made."""
    active, lines = renderer.active, []
    for name, value in changed_values(renderer).items():
        is_attribute, text = hasattr(type(renderer), name), as_text(value)
        lines.append(f"renderer.{name} = {text}" if is_attribute else f"renderer.change({name!r}, {text})")
    if isinstance(active, BlinnPhong) and active.depth != BlinnPhong().depth:
        lines.append(call("renderer.set_mirrors", [repr(int(active.depth))], {}))
    if isinstance(active, DepthMap):
        lines.append(call("renderer.set_depth", [], active.arguments()))
    return lines


class Code(str):
    """Text that is an expression of Python already."""


def call(function: str, arguments: list[str], options: dict[str, Any]) -> Code:
    """A call, as Python writes it."""
    named = [f"{name}={as_text(value)}" for name, value in options.items()]
    return Code(f"{function}({', '.join([*arguments, *named])})")


def as_text(value: Any) -> str:
    """A value as Python writes it, arrays as tuples."""
    if isinstance(value, Code):
        return str(value)
    if isinstance(value, list):
        return f"[{', '.join(map(as_text, value))}]"
    if isinstance(value, np.ndarray):
        return repr(tuple(value.tolist()))
    return repr(value.item() if isinstance(value, np.generic) else value)
