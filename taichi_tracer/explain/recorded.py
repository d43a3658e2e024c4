"""Copies of a picture's parts that behave as the parts do, and tell a log what their methods got and gave.

A recorded part is of a class that is derived from the part's own class. Its methods call the part's methods: those of
the package, or those that a student wrote in their place. Therefore the numbers in the log are those of the picture.
"""

import copy
import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import taichi as ti

from taichi_tracer.brdfs.surface import Surface
from taichi_tracer.explain.log import Log
from taichi_tracer.system.seams import in_kernels


@dataclass(frozen=True)
class Form:
    """What is noted of a method.

    Attributes:
        step: the name of the step; "" takes the name of the method.
        got: names of the arguments that are noted. gave: names of the results; with a struct or a single value, one
            name, which is "" if its members have names of their own.
        is_group: whether other steps may run within it; it is noted before and after them.
        is_limited: see ``Log.note``.
    """

    step: str = ""
    got: tuple[str, ...] = ()
    gave: tuple[str, ...] = ("value",)
    is_group: bool = False
    is_limited: bool = False


CAMERA = {
    "generate_ray": Form(gave=("",), is_group=True),
    "generate_ndc_coords": Form(gave=("ndc",)),
    "generate_camera_coords": Form(gave=("camera_coords",)),
}
NUMBERS = {"next_2d": Form("random numbers", gave=("xi",)), "next_2d_of_term": Form("random numbers", gave=("xi",))}
INTERSECTOR = {
    "query_ray": Form(got=("ray",), gave=("",), is_group=True),
    "query_segment": Form(got=("ray", "t_min", "t_max"), gave=("",), is_group=True),
    "is_occluded": Form(got=("ray", "t_max"), gave=("is_blocked",), is_group=True),
    "intersect_triangle": Form(got=("triangle_id",), gave=("",), is_limited=True),
}
SCENE = {
    "emitted": Form(gave=("L_e",)),
    "visible_radiance": Form("light from a direction", ("w_i",), ("L_i",), is_group=True),
    "is_blocked": Form("shadow ray", ("w_i", "distance"), ("is_blocked",), is_group=True),
    "met": Form("the ray that leaves the surface", ("ray",), (), is_group=True),
}
LIGHTS = {
    "sample_far": Form("a direction from the light", ("xi",), ("w_i", "pdf")),
    "pdf_far": Form("the light's density", ("w_i",), ("pdf",)),
    "sample": Form("a sample of the lights", ("xi",), ("w_i", "distance", "L_i", "pdf"), is_group=True),
    "pdf": Form("the lights' density", ("w_i",), ("pdf",)),
    "arriving": Form("light that arrives", gave=("L_i",)),
    "reflected_single": Form("lights that are sampled one by one", gave=("L",), is_group=True),
}
SURFACE = {
    "sample": Form("a direction from the BRDF", ("xi",), ("w_i",)),
    "eval": Form("f_r", ("w_i",), ("f_r",)),
    "pdf": Form("the BRDF's density", ("w_i",), ("pdf",)),
    "weight": Form("f_r cos / pdf", ("w_i",), ("weight",)),
}
OWN = {"radiance", "prepare", "facts", "controls", "change", "notes", "needs_hit"}  # of an integrator: not noted


def recorded(part: Any, log: Log, forms: dict[str, Form]) -> Any:
    """A copy of a part whose methods are noted."""
    cls = type(part)
    members = {name: wrapped(cls, name, form, log) for name, form in forms.items() if hasattr(cls, name)}
    found = copy.copy(part)
    found.__class__ = type(f"Recorded{cls.__name__}", (cls,), members)
    return found


def wrapped(cls: type, name: str, form: Form, log: Log) -> Callable:
    """The method of a class, which notes its arguments and its result."""
    original = inspect.getattr_static(cls, name)
    plain = getattr(original, "__func__", original) if isinstance(original, staticmethod) else original
    names = [n for n in inspect.signature(plain).parameters if n != "self"]
    step = form.step or name

    @functools.wraps(plain)
    def method(self, *arguments, **named):
        """The method of the part, noted."""
        given = dict(zip(names, arguments, strict=False)) | named
        got = {n: given[n] for n in form.got if n in given}
        if form.is_group:
            log.note(step, "begin", form.is_limited, **got)
            got = {}
        result = original.__get__(self, type(self))(*arguments, **named)
        log.note(step, "end" if form.is_group else "", form.is_limited, **got, **given_names(form.gave, result))
        return result

    return in_kernels(method)


def given_names(names: tuple[str, ...], result: Any) -> dict[str, Any]:
    """Name → result."""
    if not names or result is None:
        return {}
    results = result if isinstance(result, tuple | list) and len(names) > 1 else [result]
    return dict(zip(names, results, strict=False))


def recorded_intersector(intersector: Any, log: Log) -> Any:
    """An intersector that notes rays, the nodes that they enter and the primitives that they try."""
    cls = type(intersector)
    members = {}
    if hasattr(cls, "met_children"):
        members["met_children"] = noted_node(cls, log)
    if hasattr(cls, "node_interval"):
        members["node_interval"] = noted_box(cls, log)
    for name in ("try_corners", "triangle_hit"):
        if hasattr(cls, name):
            members[name] = noted_triangle(cls, name, log)
    if hasattr(cls, "sphere_candidate"):
        members["sphere_candidate"] = noted_sphere(cls, log)
    found = recorded(intersector, log, INTERSECTOR)
    found.__class__ = type(type(found).__name__, (type(found),), members)
    return found


def noted_node(cls: type, log: Log) -> Callable:
    """``met_children`` of a wide hierarchy, which notes the node and which of its boxes are met."""
    original = inspect.getattr_static(cls, "met_children")

    @functools.wraps(original)
    def method(self, bounds, node, t_min, t_max):
        """The method of the intersector, noted."""
        t_near, mask = original.__get__(self, type(self))(bounds, node, t_min, t_max)
        log.note("a node is entered", is_limited=True, node=node, boxes_met=ti.math.popcnt(mask), t_max=t_max)
        return t_near, mask

    return in_kernels(method)


def noted_box(cls: type, log: Log) -> Callable:
    """``node_interval`` of a binary hierarchy, which notes the box that is tried."""
    original = inspect.getattr_static(cls, "node_interval")

    @functools.wraps(original)
    def method(self, bounds, node, t_min, t_max):
        """The method of the intersector, noted."""
        t_near, t_far = original.__get__(self, type(self))(bounds, node, t_min, t_max)
        numbers = {"node": node, "is_met": t_near <= t_far, "t_near": t_near, "t_far": t_far}
        log.note("a box is tried", is_limited=True, **numbers)
        return t_near, t_far

    return in_kernels(method)


def noted_triangle(cls: type, name: str, log: Log) -> Callable:
    """``try_corners`` or ``triangle_hit``, which notes the numbers of the triangle test."""
    original = inspect.getattr_static(cls, name)

    @functools.wraps(original)
    def method(self, ray, *arguments):
        """The method of the intersector, noted."""
        if name == "try_corners":
            _, triangle_id, v0, v1, v2 = arguments
        else:
            triangle_id = arguments[0]
            v0, v1, v2 = self.geometry.triangle(triangle_id)
        is_inside, t, u, v, det = self.solve(ray.origin, ray.direction, v0, v1, v2)
        result = original.__get__(self, type(self))(ray, *arguments)
        taken = result[0] if name == "try_corners" else result.distance
        numbers = {"triangle_id": triangle_id, "is_inside": is_inside, "det": det, "u": u, "v": v, "t": t}
        log.note("a triangle is tried", is_limited=True, **numbers, taken=taken)
        return result

    return in_kernels(method)


def noted_sphere(cls: type, log: Log) -> Callable:
    """``sphere_candidate``, which notes t."""
    original = inspect.getattr_static(cls, "sphere_candidate")

    @functools.wraps(original)
    def method(self, ray, bounds, sphere_id, t_min):
        """The method of the intersector, noted."""
        t = original.__get__(self, type(self))(ray, bounds, sphere_id, t_min)
        log.note("a sphere is tried", is_limited=True, sphere_id=sphere_id, taken=t)
        return t

    return in_kernels(method)


def recorded_scene(scene: Any, log: Log) -> Any:
    """The part of a scene that kernels use, whose surfaces, lights and rays are noted."""
    found = recorded(scene, log, SCENE)
    found.ray_intersector = recorded_intersector(scene.ray_intersector, log)
    found.lights = recorded(scene.lights, log, LIGHTS)
    make = type(scene).surface_at

    @functools.wraps(make)
    def surface_at(self, ray, hit):
        """The surface that a ray hit, whose methods are noted."""
        surface = make(self, ray, hit)
        members = {n: wrapped(Surface, n, form, log) for n, form in SURFACE.items()}
        surface.__class__ = type("RecordedSurface", (Surface,), members)
        names = ("position", "position_error")
        numbers = {n: getattr(hit, n) for n in names}
        numbers |= {"origin": surface.origin, "normal": surface.normal, "geometric_normal": surface.geometric_normal}
        log.note("surface", w_o=surface.w_o, material_id=hit.material_id, brdf=surface.brdf_id, **numbers)
        return surface

    cls = type(found)
    found.__class__ = type(cls.__name__, (cls,), {"surface_at": in_kernels(surface_at)})
    return found


def recorded_integrator(integrator: Any, log: Log) -> Any:
    """An integrator whose own methods are noted, whatever they are called."""
    cls = type(integrator)
    forms = {}
    for name in dir(cls):
        function = inspect.getattr_static(cls, name)
        if name.startswith("_") or name in OWN or not getattr(function, "_is_taichi_function", False):
            continue
        forms[name] = Form(
            gave=("w_i", "f_cos_over_pdf") if name in ("sample", "direction") else (name,), is_group=True
        )
    return recorded(integrator, log, forms)
