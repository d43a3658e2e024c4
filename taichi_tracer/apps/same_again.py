"""What makes a picture again that is shown: the words of the command line; ``in_python`` has the lines of Python."""

import shlex
from collections.abc import Sequence
from inspect import signature
from typing import Any

from taichi_tracer.apps.options import OPTIONS, words_of
from taichi_tracer.camera import ProjectiveCamera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.integrators.path_settings import name_of as name_of_bounces
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.sampler import usual_sampler
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import name_of
from taichi_tracer.system.digits import digits
from taichi_tracer.system.registry import PARTS
from taichi_tracer.values import BOUNCES, VALUES

DISTANCE = "distance"  # the view that has a white of its own


def as_command(renderer: ProgressiveRenderer, scene_options: Sequence[str] = ()) -> str:
    """The command line that makes the picture that the renderer shows; arguments as for ``show``."""
    scene = renderer.scene_data
    words = with_choice(scene_options, "triangle_test", "triangle test", scene.ray_intersector.triangle_test)
    words = with_choice(words, "lamp_choice", "lamp choice", scene.lamps.choice.name)
    words = [word for word in words if word != "--ground"] + ["--ground"] * scene.ground
    words = ["taichi-tracer", "render", name_of(scene.source), *words]
    words += ["--view", renderer.active.name]
    if renderer.needs_light:
        environment = scene.environment
        words += ["--environment", "none" if environment is None else environment.name]
        is_usual = renderer.sampler.name == usual_sampler(bool(renderer.adaptive))
        words += ["--spp", str(renderer.samples), *([] if is_usual else ["--sampler", renderer.sampler.name])]
    words += value_words(renderer)
    words += ["--seed", str(renderer.seed)] * (renderer.seed != 0)
    words += ["--jitter"] * (renderer.jitter and not renderer.jitters) + ["--adaptive"] * bool(renderer.adaptive)
    words += renderer.display.words() if renderer.srgb and not renderer.has_own_display else []
    words += ["--size", f"{renderer.width}x{renderer.height}"]
    return shlex.join([*words, *camera_words(renderer.camera)])


def changed_values(renderer: ProgressiveRenderer) -> dict[str, Any]:
    """The values of a renderer that are not the defaults, and that the picture in use may depend on."""
    known = ((VALUES[name], value) for name, value in renderer.values().items() if name in VALUES)
    return {of.name: value for of, value in known if value != of.default and of.of in ("", renderer.active.name)}


def value_words(renderer: ProgressiveRenderer) -> list[str]:
    """The options for these values."""
    options = {option.value: name for name, option in OPTIONS.items() if option.value}
    words = {options[name]: value for name, value in changed_values(renderer).items()}
    if "bounces" in words:
        words["bounces"] = name_of_light(renderer)
    return words_of(**words)


def name_of_light(renderer: ProgressiveRenderer) -> str:
    """The name of the bounces whose light is shown, as ``--bounces`` takes it; "" if all of it is shown."""
    bounces = renderer.values().get(BOUNCES.name)
    return "" if bounces is None else name_of_bounces(bounces)


def with_choice(words: Sequence[str], argument: str, kind: str, name: str) -> list[str]:
    """The options of a scene with this part for an argument; it is not named if it is the default, or not registered.

    Args:
        argument: of ``SceneData``. kind: of the part, in the registry. name: of the part.
    """
    option, changed = f"--{argument.replace('_', '-')}", list(words)
    if option in changed:
        changed[changed.index(option) + 1] = name
    elif name in set(PARTS.names(kind)) - {signature(SceneData).parameters[argument].default}:
        changed += [option, name]
    return changed


def camera_words(camera: ProjectiveCamera) -> list[str]:
    """The options that make a camera again: its window at distance 1, or in world units if it is orthographic."""
    words = []
    for name in ("eye", "at", "up"):
        words += [f"--{name}", *(digits(x, ".9g") for x in getattr(camera, name))]
    words += ["--camera", camera.name]
    if camera.has_window:
        scale = 1.0 if isinstance(camera, OrthographicCamera) else camera.focal_distance
        words += ["--window", *(digits(edge / scale, ".9g") for edge in camera.screen_window)]
    else:
        words += ["--fov", f"{camera.fov:.9g}"]
    return [*words, "--handedness", camera.handedness]


def position_of(camera: ProjectiveCamera) -> dict:
    """The arguments of ``set_camera_parameters`` that bring the camera back to where it is."""
    position = {name: getattr(camera, name) for name in ("eye", "at", "up", "handedness")}
    return position | ({"screen_window": camera.screen_window} if camera.has_window else {"fov": camera.fov})
