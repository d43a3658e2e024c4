"""Explains a pixel: its samples are computed once more, and one of them is noted step by step."""

import copy
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti
from taichi.lang import expr, impl, struct

from taichi_tracer.explain.explanation import Entry, Explanation, steps_of, terms_of, thumbnail
from taichi_tracer.formulas import vector_math as tm
from taichi_tracer.integrators.path_settings import PathSettings
from taichi_tracer.picture.film import Film
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.observed import Observer, after, observed, observed_scene
from taichi_tracer.system.some_pixels import SomePixels

# ── the log ──


MOST_KINDS = 64  # of steps that are limited; a picture has about ten of them
CAPACITY = 1 << 18  # numbers; a path of 64 bounces needs less
MOST_OF_A_KIND = 400  # entries of a kind that is limited: more of them say nothing new


@ti.data_oriented
class Log:
    """See the module. ``clear`` before the kernel, ``read`` after it."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self._limits: dict[str, int] = {}
        self._memory = memory.Memory()
        self.number_type = ti.f64 if runtime.can("f64") else ti.f32
        self.numbers = ti.field(self.number_type)
        # place: where the values of the entry that is being noted begin; −1 if they are not kept.
        self.used, self.is_on, self.is_full, self.place = (ti.field(ti.i32) for _ in range(4))
        self.counts = ti.field(ti.i32)
        self._memory.fields.dense(ti.i, CAPACITY).place(self.numbers)
        self._memory.fields.place(self.used, self.is_on, self.is_full, self.place)
        self._memory.fields.dense(ti.i, MOST_KINDS).place(self.counts)
        self._memory.allocate()

    def clear(self) -> None:
        """Forget everything that was noted, and note nothing until ``is_on`` is 1."""
        self.used[None] = self.is_on[None] = self.is_full[None] = 0
        self.counts.fill(0)

    @compile_time
    def note(self, name: str, mark: str = "", is_limited: bool = False, **values: Any) -> None:
        """Note named values; kernels call it.

        Args:
            name, mark: as for ``Entry``. is_limited: whether only the first ``MOST_OF_A_KIND`` of this name are kept;
                all of them are counted.
            values: numbers, vectors, or structs, whose members become values of their own.
        """
        flat, names = [], []
        for key, value in values.items():
            flatten(key, value, names, flat)
        self.entries.append(Entry(name, mark, tuple(names)))
        limit = self._limits.setdefault(name, len(self._limits)) if is_limited else -1
        self._begin(len(self.entries) - 1, len(flat), limit)
        for k, number in enumerate(flat):
            self._store(k, number)

    @ti.func
    def _begin(self, number: ti.template(), count: ti.template(), limit: ti.template()):
        """Store the number of an entry, and make room for its values if they are kept."""
        self.place[None] = -1
        if self.is_on[None] != 0:
            is_kept = self.used[None] + count + 1 <= CAPACITY
            if ti.static(limit >= 0):
                self.counts[limit] = self.counts[limit] + 1
                is_kept = is_kept and self.counts[limit] <= MOST_OF_A_KIND
            if is_kept:
                self.numbers[self.used[None]] = number
                self.place[None] = self.used[None] + 1
                self.used[None] = self.used[None] + count + 1
            elif self.used[None] + count + 1 > CAPACITY:
                self.is_full[None] = 1

    @ti.func
    def _store(self, k: ti.template(), number):
        if self.place[None] >= 0:
            self.numbers[self.place[None] + k] = ti.cast(number, self.number_type)

    def read(self) -> tuple[list[tuple[Entry, dict[str, Any]]], dict[str, int]]:
        """Everything that was noted, in order, and how often each limited step ran."""
        numbers, used, found, at = self.numbers.to_numpy(), int(self.used[None]), [], 0
        while at < used:
            entry = self.entries[int(numbers[at])]
            at += 1
            values: dict[str, Any] = {}
            for name, size in entry.values:
                values[name] = numbers[at] if size == 0 else np.array(numbers[at : at + size])
                at += max(size, 1)
            found.append((entry, values))
        counts = self.counts.to_numpy()
        return found, {name: int(counts[i]) for name, i in self._limits.items()}


def flatten(name: str, value: Any, names: list[tuple[str, int]], flat: list[Any]) -> None:
    """Append the numbers of a value, at compile time, and the name and size of each of its vectors and numbers."""
    if value is None:
        return
    if isinstance(value, struct.Struct):
        for member in value.keys:
            flatten(member if not name else f"{name}.{member}", getattr(value, member), names, flat)
    elif isinstance(value, tuple | list):
        for k, part in enumerate(value):
            flatten(f"{name}[{k}]", part, names, flat)
    elif isinstance(value, expr.Expr) and value.is_tensor():
        shape = value.get_shape()
        if len(shape) == 1:
            names.append((name, shape[0]))
            flat += [impl.subscript(None, value, k) for k in range(shape[0])]
    elif isinstance(value, expr.Expr | int | float | bool | np.number):
        names.append((name, 0))
        flat.append(value)


# ── observers ──


@dataclass(frozen=True)
class NotedMethod:
    """What is noted of a method.

    Attributes:
        step: the name of the step; "" takes the name of the method.
        got: names of the arguments that are noted. gave: names of the first results; with a struct or a single value,
            one name, which is "" if its members have names of their own.
        is_group: whether other steps may run within it; it is noted before and after them.
        is_limited: see ``Log.note``.
    """

    step: str = ""
    got: tuple[str, ...] = ()
    gave: tuple[str, ...] = ("value",)
    is_group: bool = False
    is_limited: bool = False


CAMERA = {
    "generate_ray": NotedMethod(gave=("",), is_group=True),
    "generate_ndc_coords": NotedMethod(gave=("ndc",)),
    "generate_camera_coords": NotedMethod(gave=("camera_coords",)),
}
NUMBERS = {
    "next_2d": NotedMethod("random numbers", gave=("xi",)),
    "next_2d_of_term": NotedMethod("random numbers", gave=("xi",)),
}
INTERSECTOR = {
    "query_ray": NotedMethod(got=("ray",), gave=("",), is_group=True),
    "query_segment": NotedMethod(got=("ray", "t_min", "t_max"), gave=("",), is_group=True),
    "is_occluded": NotedMethod(got=("ray", "t_max"), gave=("is_blocked",), is_group=True),
    "node_interval": NotedMethod("a box is tried", ("node", "t_max"), ("t_near", "t_far"), is_limited=True),
    "intersect_triangle": NotedMethod(got=("triangle_id",), gave=("",), is_limited=True),
    "sphere_candidate": NotedMethod("a sphere is tried", ("sphere_id",), ("taken",), is_limited=True),
    # Of objects that stand in several places: from here on, nodes are those of the object.
    "bounds_in": NotedMethod("a place is entered", ("place",), (), is_limited=True),
    "ellipsoid_in": NotedMethod("a sphere is tried", ("place", "sphere_id"), ("taken",), is_limited=True),
}
SCENE = {
    "emitted": NotedMethod(gave=("L_e",)),
    "visible": NotedMethod("light from a direction", ("w_i",), ("L_i",), is_group=True),
    "reflected_single": NotedMethod("lights that are sampled one by one", gave=("L",), is_group=True),
    "is_blocked": NotedMethod("shadow ray", ("w_i", "distance"), ("is_blocked",), is_group=True),
    "met": NotedMethod("the ray that leaves the surface", ("ray",), (), is_group=True),
}
LIGHTS = {
    "sample": NotedMethod("a sample of the lights", ("xi",), ("w_i", "distance", "L_i", "pdf"), is_group=True),
    "pdf": NotedMethod("the lights' density", ("w_i",), ("pdf",)),
    "sample_drawn": NotedMethod("a sample of one light", ("k",), ("w_i", "distance", "L_i", "pdf")),
    "reflected_ambient": NotedMethod("ambient light", gave=("L",)),
    "arriving": NotedMethod("light that arrives", gave=("L_i",)),
}
SURFACE = {
    "sample": NotedMethod("a direction from the BRDF", ("xi",), ("w_i",)),
    "eval": NotedMethod("f_r", ("w_i",), ("f_r",)),
    "eval_cosine": NotedMethod("f_r cos", ("w_i",), ("f_cos",), is_group=True),
    "pdf": NotedMethod("the BRDF's density", ("w_i",), ("pdf",)),
    "weight": NotedMethod("f_r cos / pdf", ("w_i",), ("f_cos_over_pdf",)),
}
PATHS = {
    "counts": NotedMethod("bounces that count", ("depth",), ("counts",)),
    "survival": NotedMethod("Russian roulette", ("depth",), ("survival",)),
}
HEURISTIC = NotedMethod("MIS weight", ("pdf", "other"), ("weight",))  # of an integrator
OWN = {"radiance", "prepare", "facts", "controls", "change", "notes", "needs_hit"}  # of an integrator: not noted


def recorded(part: Any, log: Log, forms: Mapping[str, NotedMethod]) -> Any:
    """A copy of a part whose methods are noted."""
    return observed(part, noted(log, forms))


def noted(log: Log, forms: Mapping[str, NotedMethod]) -> dict[str, Observer]:
    """The observers that note methods."""
    return {name: noted_method(log, form.step or name, form) for name, form in forms.items()}


def noted_method(log: Log, step: str, form: NotedMethod) -> Observer:
    """The observer that notes the arguments and the result of a method."""

    def observer(part: Any, call: Callable, *arguments: Any) -> Any:
        names = inspect.signature(call).parameters
        got = {name: one for name, one in zip(names, arguments, strict=False) if name in form.got}
        if form.is_group:
            log.note(step, "begin", form.is_limited, **got)
            got = {}
        result = call(*arguments)
        results = result if isinstance(result, tuple | list) else [result]
        gave = dict(zip(form.gave, results, strict=False))
        log.note(step, "end" if form.is_group else "", form.is_limited, **got, **gave)
        return result

    return observer


def note_triangle(log: Log, part: Any, ray: Any, triangle_id: Any, corners: Any, taken: Any) -> None:
    """Note the numbers of the triangle test, and the distance that was ``taken``."""
    is_inside, t, u, v, det = part.solve(ray.origin, ray.direction, *corners)
    numbers = {"triangle_id": triangle_id, "is_inside": is_inside, "det": det, "u": u, "v": v, "t": t}
    log.note("a triangle is tried", is_limited=True, **numbers, taken=taken)


def noted_search(log: Log) -> dict[str, Observer]:
    """The observers that note the nodes that a ray enters, and the primitives that it tries."""

    def entered(part, result, bounds, node, t_min, t_max):
        """``met_children`` of a wide hierarchy: the node, and how many of its boxes are met."""
        log.note("a node is entered", is_limited=True, node=node, boxes_met=tm.popcnt(result[1]), t_max=t_max)

    def tried_corners(part, result, ray, bounds, primitive_id, triangle_id, corners, facing):
        """``try_corners``."""
        note_triangle(log, part, ray, primitive_id, corners, result[0])

    def tried_solved(part, result, ray, aim, place, *numbers):
        """``solved`` of a triangle whose block was solved at once."""
        note_triangle(log, part, ray, part.blocks.primitive(place), part.blocks.triangle(place), result[0])

    return {
        "met_children": after(entered),
        "try_corners": after(tried_corners),
        "solved": after(tried_solved),
    }


def recorded_scene(scene: Any, log: Log) -> Any:
    """The part of a scene that kernels use, whose surfaces, lights and rays are noted."""

    def made(part, surface, ray, hit):
        """``surface_at``."""
        log.note(
            "surface",
            w_o=surface.w_o,
            material_id=hit.material_id,
            brdf=surface.brdf_id,
            is_delta=surface.is_delta(),
            position=hit.position,
            position_error=hit.position_error,
            origin=surface.origin,
            normal=surface.normal,
            geometric_normal=surface.geometric_normal,
        )

    def drawn(surface, w_i, xi):
        """``sample`` of a surface: the density of the direction, which not every estimator asks for."""
        surface.pdf(w_i)

    def weighed(surface, pdf, w_i):
        """``pdf`` of a surface: f_r of the direction."""
        surface.eval(w_i)

    def arrived(part, found, surface, w_i, factor):
        """``visible``: the densities of a direction, whatever drew it."""
        surface.pdf(w_i)
        if not part.lights.has_lamps:  # otherwise ``met`` was asked
            ask_lights(part, surface, w_i, found[1])

    def met(part, hit, surface, ray):
        """``met``."""
        ask_lights(part, surface, ray.direction, hit)

    def ask_lights(part, surface, w_i, hit):
        """The density with which a sample of the lights has a direction, where the scene's lights can be sampled."""
        if part.samples_lights:
            part.lights.pdf(surface.origin, surface.normal, w_i, hit)

    found = observed_scene(
        scene,
        {
            "scene": noted(log, SCENE),
            "lights": noted(log, LIGHTS),
            "ray_intersector": noted_search(log) | noted(log, INTERSECTOR),
            "surface": noted(log, SURFACE),
        },
    )
    return observed_scene(
        found,
        {
            "scene": {"surface_at": after(made), "visible": after(arrived), "met": after(met)},
            "surface": {"sample": after(drawn), "pdf": after(weighed)},
        },
    )


def recorded_integrator(integrator: Any, log: Log) -> Any:
    """An integrator whose own methods are noted, whatever they are called."""
    cls = type(integrator)
    forms = {}
    for name in dir(cls):
        function = inspect.getattr_static(cls, name)
        if name.startswith("_") or name in OWN or not getattr(function, "_is_taichi_function", False):
            continue
        gave = ("w_i", "f_cos_over_pdf") if name == "sample" else (name,)
        forms[name] = HEURISTIC if name == "heuristic" else NotedMethod(gave=gave, is_group=True)
    found = recorded(integrator, log, forms)
    if isinstance(getattr(found, "settings", None), PathSettings):
        found.settings = recorded(found.settings, log, PATHS)
    return found


# ── what is noted ──


@ti.data_oriented
class PixelExplainer:
    """Takes the samples of one pixel at a time with the observed parts of a renderer, and notes one of them.

    Args:
        renderer: whose pixels are explained.
        parts: what its samples are made of, ``SampleParts``.
    """

    def __init__(self, renderer: Any, parts: Any) -> None:
        self.renderer, self.log, self._of = renderer, Log(), (parts.scene, parts.integrator, renderer.camera)
        self.film = Film(1, 1, **renderer.film.kind)
        self.pixels = SomePixels(self.end)
        scene, eye_rays = recorded_scene(parts.scene, self.log), copy.copy(parts.eye_rays)
        eye_rays.camera, eye_rays.intersector = recorded(renderer.camera, self.log, CAMERA), scene.ray_intersector
        self.parts = parts._replace(
            scene=scene,
            integrator=recorded_integrator(parts.integrator, self.log),
            eye_rays=eye_rays,
            sampler=observed(parts.sampler, {"start": lambda part, call, *of: recorded(call(*of), self.log, NUMBERS)}),
            film=self.pixels,
        )
        self._memory = memory.Memory()
        self.value = ti.Vector.field(3, float)
        self._memory.fields.place(self.value)
        self._memory.allocate()

    def is_of(self, *parts: Any) -> bool:
        """Whether it explains with this scene, integrator and camera, and Taichi was not started again since."""
        return not self._memory.is_over() and all(one is own for one, own in zip(parts, self._of, strict=True))

    def explain(self, column: int, row: int, sample: int | None, first: int, count: int) -> Explanation:
        """The explanation of a sample of the pixel in this column from the left and this row from the top.

        Args:
            sample: which one; None is the one that is farthest from the mean.
            first, count: the index of the first sample, and how many there are.
        """
        r, self.first = self.renderer, first
        x, y = column, r.height - 1 - row
        self.pixels.choose((x, x + 1), (y, y + 1))
        values = self.take(count, sample)
        if sample is None:
            sample = farthest(values)
            values = self.take(count, sample)
        noted, counts = self.log.read()
        steps = steps_of(noted)
        return Explanation(
            renderer=type(r).__name__,
            integrator=self.parts.integrator.name,
            column=column,
            row=row,
            x=x,
            y=y,
            sample=first + sample,
            samples=count,
            value=values[sample],
            mean=self.film.image()[0, 0],
            error=self.film.standard_error().astype(np.float32)[0, 0] if r.is_random else np.zeros(3),
            steps=steps,
            counts=counts,
            is_complete=self.log.is_full[None] == 0,
            terms=tuple(terms_of(steps, self.share)) if r.srgb else (),
            thumbnail=thumbnail(r.film.image(), column, row, r.display, r.srgb) if r.film.samples > 0 else "",
        )

    def share(self, pdf: float, other: float) -> float | None:
        """The MIS weight of a sample of the density ``pdf``, from the formula of the picture; None if it has none."""
        integrator = self.parts.integrator
        return heuristic_of(integrator, pdf, other) if integrator.exponent > 0 else None

    def take(self, count: int, sample: int | None) -> np.ndarray:
        """(count, 3) the values of so many samples; one of them is noted, if any."""
        r, values = self.renderer, np.zeros((count, 3))
        self.film.reset()
        self.log.clear()
        for k in range(count):
            if sample is not None and k in (sample, sample + 1):
                self.log.is_on[None] = int(k == sample)
            r._take_samples(self.parts, r.shares.seed_of(r.seed), self.first + k, 1)
            values[k] = self.value.to_numpy()
        return values

    @ti.func
    def end(self, x, y, value, index):
        """Add a sample to the pixel, and keep its value."""
        self.value[None] = value
        self.film.record(0, 0, value, index)


@ti.kernel
def heuristic_of(integrator: ti.template(), pdf: float, other: float) -> float:
    """The integrator's ``heuristic``, called by Python."""
    return integrator.heuristic(pdf, other)


def farthest(values: np.ndarray) -> int:
    """Which of (n, 3) samples is farthest from their mean; the first that is not finite, if there is one."""
    is_odd = ~np.isfinite(values).all(axis=1)
    return int((is_odd if is_odd.any() else abs(values - values.mean(axis=0)).sum(axis=1)).argmax())


def explained(renderer: Any, column: int, row: int, sample: int | None, samples: int | None) -> Explanation:
    """The explanation of a sample of a renderer's pixel, see ``RenderedPicture.explain``."""
    renderer.scene_data.check_alive()
    if not renderer.is_current():
        renderer.begin()
    for name, value, size in (("column", column, renderer.width), ("row", row, renderer.height)):
        if value not in range(size):
            raise InputError(f"explain: the {name} must be a whole number from 0 to {size - 1}, not {value}")
    passes = renderer.first_sample, renderer.first_sample + renderer.film.samples
    first, end = renderer.shares.range_of(column, renderer.height - 1 - row, *passes)
    samples = max(1, end - first) if samples is None else samples
    if (sample or 0) not in range(samples):
        raise InputError(f"explain: the sample must be a whole number from 0 to {samples - 1}, not {sample}")
    scene, integrator = renderer.kernel_scene(), renderer.explained
    scene.lights.prepare(integrator.samples_lights or (integrator.needs_light and scene.samples_lights))
    former = renderer.explainer
    if former is None or not former.is_of(scene, integrator, renderer.camera):
        renderer.explainer = PixelExplainer(renderer, renderer.plain_sample_parts(scene, integrator))
    return renderer.explainer.explain(column, row, sample, first, samples)
