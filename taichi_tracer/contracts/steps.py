"""Which checks belong to a part: each with what it checks, in words."""

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import taichi_tracer as tt
from taichi_tracer.contracts import (
    brdfs,
    cameras,
    integrators,
    intersectors,
    lamp_choices,
    lights,
    samplers,
    tones,
    triangle_tests,
    views,
)
from taichi_tracer.system.seams import replaced

Step = tuple[str, Callable[[], Any]]  # what is checked, and the check


def steps_of(part: Any) -> list[Step]:
    """The checks of a part; none of a renderer, which only puts others together."""
    kind = part.kind
    if kind == "BRDF":
        return named(brdfs.steps(part), part) if brdfs.described_materials(part) else []
    if kind == "light":
        return steps_of_light(part)
    if kind == "environment":
        return steps_of_environment(part)
    if kind == "camera":
        return named(cameras.STEPS, part(cameras.WIDTH, cameras.HEIGHT))
    if kind == "sampler":
        return named(samplers.STEPS, samplers.bound(part)) if hasattr(part, "get_2d") else []
    if kind == "intersector":
        is_own = {"intersect_triangle", "query_ray", "triangle_hit"} & set(replaced(part))
        return named([intersectors.check_equals_the_packages if is_own else intersectors.check_intersector], part)
    if kind == "integrator":
        return steps_of_integrator(part)
    checks = {
        "triangle test": triangle_tests.STEPS,
        "tone curve": [tones.check_tone],
        "lamp choice": [lamp_choices.check_lamp_choice],
    }
    return named(checks.get(kind, []), part)


def steps_of_light(light: Any) -> list[Step]:
    """Those of a light. A scene for one that rays meet is not known here: of it, only samples are checked."""
    if light.is_ambient:
        return named([lights.check_ambient, lights.check_facts], light)
    checks = lights.steps(light) if light.is_far or light.is_delta else [lights.check_samples_are_legal]
    return [*named(checks, lights.Bench(light)), *named([lights.check_facts], light)]


def steps_of_environment(environment: Any) -> list[Step]:
    """Those of a light that surrounds a triangle, which is lit by the environment alone."""
    scene = tt.scene_from_mesh(np.eye(3), [[0, 1, 2]], environment=environment())
    light, image = scene.in_kernels().lights.far[0], scene.environment
    bench = lights.Bench(light)
    steps = named([step for step in lights.steps(light) if step is not lights.check_sample_follows_pdf], bench)
    is_constant_in_texels = image.lookup == "nearest" and image.height >= lights.ROWS and image.constant is None
    if is_constant_in_texels:
        check = lights.check_sample_follows_texels
        steps.append((sentence(check), partial(check, bench, int(image.height), int(image.width))))
    return steps


def steps_of_integrator(integrator: Any) -> list[Step]:
    """Those of a view; finite samples of any other; and the means of an estimator of light, which needs some."""
    if integrator.what == "view":
        return named([views.check_view], integrator)
    checks = [integrators.check_samples_are_finite]
    if integrator.what == "estimator" and integrator.srgb and integrator.needs_light:
        checks += [integrators.check_constant_light, integrators.check_sky_sun_and_emission]
    return named(checks, integrator)


def named(checks: Any, subject: Any) -> list[Step]:
    """Checks with their first sentences."""
    return [(sentence(check), partial(check, subject)) for check in checks]


def sentence(check: Callable) -> str:
    """The first sentence of a check's documentation, without the full stop."""
    text = " ".join((inspect.getdoc(check) or check.__name__).split("\n\n")[0].split())
    return text.split(". ")[0].rstrip(".").replace("``", "")
