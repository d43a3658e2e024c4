"""Explains a pixel: its samples are computed once more, and one of them is noted step by step."""

import copy
from typing import Any

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.explain.explanation import Explanation, thumbnail
from taichi_tracer.explain.recorded import CAMERA, NUMBERS, Log, recorded, recorded_integrator, recorded_scene
from taichi_tracer.explain.terms import steps_of, terms_of
from taichi_tracer.picture.film import Film
from taichi_tracer.system import memory
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.observed import after, observed
from taichi_tracer.system.some_pixels import SomePixels

LOBE_ANGLES = 1441  # an eighth of a degree: narrow lobes are drawn, too


@ti.data_oriented
class PixelExplainer:
    """Takes the samples of one pixel at a time with the observed parts of a renderer, and notes one of them.

    Args:
        renderer: whose pixels are explained.
        parts: what its samples are made of, ``SampleParts``.
    """

    def __init__(self, renderer: Any, parts: Any) -> None:
        self.renderer, self.log, self._of = renderer, Log(), (parts.scene, parts.integrator, renderer.camera)
        film = renderer.film
        self.film = Film(
            1, 1, None, film.halves == 2 and not film.doubles, film.keeps_deviation, film.averages, film.doubles
        )
        self.pixels, self.scene = SomePixels(self.end), parts.scene
        scene, eye_rays = recorded_scene(parts.scene, self.log), copy.copy(parts.eye_rays)
        eye_rays.camera, eye_rays.intersector = recorded(renderer.camera, self.log, CAMERA), scene.ray_intersector
        self.parts = parts._replace(
            scene=scene,
            integrator=recorded_integrator(parts.integrator, self.log),
            eye_rays=observed(eye_rays, {"hit_of": after(lambda part, found, *_: self.begin(*found))}),
            sampler=observed(parts.sampler, {"start": lambda part, call, *of: recorded(call(*of), self.log, NUMBERS)}),
            film=self.pixels,
        )
        self._memory = memory.Memory()
        self.value, self.lobe, self.has_lobe = ti.Vector.field(3, float), ti.field(float), ti.field(ti.i32)
        self._memory.fields.place(self.value, self.has_lobe)
        self._memory.fields.dense(ti.i, LOBE_ANGLES).place(self.lobe)
        self._memory.allocate()

    def is_of(self, *parts: Any) -> bool:
        """Whether it explains with this scene, integrator and camera, and Taichi was not started again since."""
        return not self.log.is_over() and all(one is own for one, own in zip(parts, self._of, strict=True))

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
            error=self.film.standard_error()[0, 0] if r.is_random else np.zeros(3),
            steps=steps,
            counts=counts,
            is_complete=self.log.is_full[None] == 0,
            lobe=self.lobe.to_numpy() if self.has_lobe[None] else None,
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
        self.log.is_on[None] = 0
        for k in range(count):
            if sample is not None and k in (sample, sample + 1):
                self.log.is_on[None] = int(k == sample)
            r._take_samples(self.parts, r.seed, self.first + k, 1)
            values[k] = self.value.to_numpy()
        return values

    @compile_time
    def begin(self, ray, hit) -> None:
        """Keep the eye ray of a sample, and what it hits."""
        self.ray, self.hit = ray, hit

    @ti.func
    def end(self, x, y, value, index):
        """Add a sample to the pixel, and keep its value, and its lobe if it is the one that is noted."""
        self.value[None] = value
        if self.log.is_on[None] != 0:
            self.has_lobe[None] = 0
            if ti.static(self.renderer.srgb):
                if self.hit.is_hit:
                    self.draw_lobe(self.scene, self.ray, self.hit)
        self.film.record(0, 0, value, index)

    @ti.func
    def draw_lobe(self, scene: ti.template(), ray, hit):
        """Keep f_r cos θ of a surface, for directions in the plane of the normal and the viewer."""
        surface = scene.surface_at(ray, hit)
        self.has_lobe[None] = ti.cast(not surface.is_delta(), ti.i32)
        n, w_o = surface.normal, surface.w_o
        across = w_o - tm.dot(w_o, n) * n
        if across.norm() < 1e-6:
            across = tm.cross(n, ti.select(abs(n.x) < 0.9, tm.vec3(1, 0, 0), tm.vec3(0, 1, 0)))
        tangent = across.normalized()
        for k in range(LOBE_ANGLES):
            angle = tm.pi * (k / (LOBE_ANGLES - 1) - 0.5)
            w_i = ti.sin(angle) * tangent + ti.cos(angle) * n
            self.lobe[k] = surface.eval_cosine(w_i).sum() / 3


@ti.kernel
def heuristic_of(integrator: ti.template(), pdf: float, other: float) -> float:
    """The integrator's ``heuristic``, called by Python."""
    return integrator.heuristic(pdf, other)


def farthest(values: np.ndarray) -> int:
    """Which of (n, 3) samples is farthest from their mean; the first that is not finite, if there is one."""
    is_odd = ~np.isfinite(values).all(axis=1)
    return int((is_odd if is_odd.any() else abs(values - values.mean(axis=0)).sum(axis=1)).argmax())


def check_pixel(renderer: Any, column: int, row: int) -> None:
    """Raise an InputError if a picture has no such pixel."""
    for name, value, size in (("column", column, renderer.width), ("row", row, renderer.height)):
        if not 0 <= value < size:
            raise InputError(f"explain: the {name} must be from 0 to {size - 1}, not {value}")


def explained(renderer: Any, column: int, row: int, sample: int | None, samples: int | None) -> Explanation:
    """The explanation of a sample of a renderer's pixel, see ``RenderedPicture.explain``."""
    renderer.scene_data.check_alive()
    if not renderer.is_current():
        renderer.begin()
    check_pixel(renderer, column, row)
    passes = renderer.first_sample, renderer.first_sample + renderer.film.samples
    first, end = renderer.shares.range_of(column, renderer.height - 1 - row, *passes)
    samples = max(1, end - first) if samples is None else samples
    if not 0 <= (sample or 0) < samples:
        raise InputError(f"explain: the sample must be from 0 to {samples - 1}, not {sample}")
    scene, integrator = renderer.kernel_scene(), renderer.explained
    scene.lights.prepare(integrator.samples_lights or (integrator.needs_light and scene.samples_lights))
    former = renderer.explainer
    if former is None or not former.is_of(scene, integrator, renderer.camera):
        renderer.explainer = PixelExplainer(renderer, renderer.plain_sample_parts(scene, integrator))
    return renderer.explainer.explain(column, row, sample, first, samples)
