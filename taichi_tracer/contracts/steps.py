"""Which checks belong to a part: each with what it checks, in words."""

from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
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
)
from taichi_tracer.contracts.statistics import SphereCells
from taichi_tracer.sampler import sampler_of
from taichi_tracer.system.own_code.checks import what_it_says
from taichi_tracer.system.parts import replaced


def steps_of(part: Any) -> list[tuple[str, Callable[[], Any]]]:
    """What is checked of a part, and the check; none of a renderer, which only puts others together."""
    picture = SimpleNamespace(width=samplers.WIDTH, height=samplers.HEIGHT)
    kinds: dict[str, Callable[[], Any]] = {
        "BRDF": lambda: (brdfs.Bench(part), brdfs.steps(part)) if brdfs.described_materials(part) else (part, ()),
        "camera": lambda: (part(cameras.WIDTH, cameras.HEIGHT), cameras.STEPS),
        "sampler": lambda: (sampler_of(part, picture), samplers.STEPS) if hasattr(part, "get_2d") else (part, ()),
        "intersector": lambda: (part, [check_of_intersector(part)]),
        "integrator": lambda: (part, checks_of_integrator(part)),
        "triangle test": lambda: (part, triangle_tests.STEPS),
        "tone curve": lambda: (part, [tones.check_tone]),
        "lamp choice": lambda: (part, [lamp_choices.check_lamp_choice]),
        "light": lambda: (lights.Bench(part), (*lights.steps(part), lights.check_facts)),
        "environment": lambda: environment_and_checks(part),
    }
    subject, checks = kinds.get(part.kind, lambda: (part, ()))()
    return [(what_it_says(check), partial(check, subject)) for check in checks]


def check_of_intersector(part: Any) -> Callable:
    """To the last bit; or up to rounding, if it has a test of triangles of its own."""
    is_own = {"intersect_triangle", "query_ray"} & set(replaced(part))
    return intersectors.check_equals_the_packages if is_own else intersectors.check_intersector


def checks_of_integrator(integrator: Any) -> list[Callable]:
    """Those of a view; finite samples of any other; and the means of an estimator of light, which needs some."""
    checks = [integrators.check_view if integrator.what == "view" else integrators.check_samples_are_finite]
    if integrator.what == "estimator" and integrator.srgb and integrator.needs_light:
        checks.append(integrators.check_sky_sun_and_emission)
    return checks


def environment_and_checks(environment: Any) -> tuple[lights.Bench, tuple[Callable, ...]]:
    """A light that surrounds a triangle, lit by the environment alone, which is turned by whole texels; its checks."""
    made = environment()
    rows, columns = made.pixels.shape[:2]
    made.set_rotation(round(made.rotation * columns / 360) * 360 / columns)
    light = tt.scene_from_mesh(np.eye(3), [[0, 1, 2]], environment=made).in_kernels().lights.far[0]
    bench = lights.Bench(light, cells=SphereCells.equal_angles(rows, columns))
    return bench, lights.steps(light)
