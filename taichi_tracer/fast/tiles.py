"""Samples of a whole tile of pixels: first all of them are shaded, then their shadow rays are traced together.

The plain form traces each shadow ray where it is needed. Here, ``scene.visible_radiance`` writes down the ray and the
light that it would find, and the sample goes on without it. When all pixels of the tile are shaded, their rays are
traced as streams (``shadow_streams``), and what is not blocked is added to the samples. A sample is a sum, so that it
does not matter when its terms are found: the picture has the same bits.
"""

import copy
import functools

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.primary_hits import PrimaryHits
from taichi_tracer.fast.shadow_streams import ShadowStreams
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.integrators.direct_light import DirectLight
from taichi_tracer.lights.near_misses import begin_counting, code_of_look_up, count_look_up, note_look_up
from taichi_tracer.lights.scene_lights import may_meet
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.seams import in_kernels

SIDE = 32  # of a tile, in pixels: its rays are near enough to each other, and they stay in the cache of a CPU
PLACES_PER_THREAD = 2  # so that a thread that is done early finds more work


def can_wait(scene, integrator) -> bool:
    """Whether the shadow rays of an integrator may be traced later: only if each sample is the plain sum of their light.

    That is so for the estimators of direct light, in scenes whose light is far away. Methods that a student wrote in
    their place might do something else with the light, and so they get it at once.
    """
    is_sum = isinstance(integrator, DirectLight) and type(integrator).__module__ == DirectLight.__module__
    lights = scene.lights
    only_far = len(lights.far) > 0 and not lights.single and not lights.has_lamps
    return is_sum and only_far and scene.effects.is_lit and scene.effects.blockers != "none"


def waiting_class(cls: type, tiles: "Tiles") -> type:
    """The class of a scene whose shadow rays wait."""

    @functools.wraps(cls.visible_radiance)
    def visible_radiance(self, surface, w_i, factor):
        """``Tiles.wait``."""
        return tiles.wait(self, surface, w_i, factor)

    return type(f"Waiting{cls.__name__}", (cls,), {"visible_radiance": in_kernels(visible_radiance)})


@ti.data_oriented
class Tiles:
    """Takes samples tile by tile.

    Fields of a pixel that waits for its rays, in each place:
        pixel: its column and row, and the index of its sample. value: its sample so far. end: the number of the first
            ray that belongs to the next pixel.
    Fields of a ray in each place:
        light: what it adds to its sample if nothing blocks it. code: what it counts for, see ``NearMissCounter.code``.

    Args:
        renderer: the ``ProgressiveRenderer``.
        scene: a ``SceneInKernels``, with a ``WideBVH``.
        integrator: an integrator for which ``can_wait`` holds.
    """

    def __init__(self, renderer, scene, integrator) -> None:
        self.renderer, self.scene, self.integrator = renderer, copy.copy(scene), integrator
        self.is_of = scene, integrator
        self.scene.__class__ = waiting_class(type(scene), self)
        (self.x0, self.x1), (self.y0, self.y1) = renderer.film.ranges
        self.across, self.upwards = -(-(self.x1 - self.x0) // SIDE), -(-(self.y1 - self.y0) // SIDE)
        self.tiles = self.across * self.upwards
        self.places = min(self.tiles, PLACES_PER_THREAD * ti.cfg.cpu_max_num_threads)
        most = SIDE * SIDE * integrator.techniques
        self.streams = ShadowStreams(scene.ray_intersector, self.places, most)
        self._memory = memory.Memory()
        place = self._memory.fields.dense(ti.i, self.places)
        self.waiting, self.pixel, self.end = ti.field(ti.i32), ti.Vector.field(3, ti.i32), ti.field(ti.i32)
        self.value, self.light, self.code = ti.Vector.field(3, float), ti.Vector.field(3, float), ti.field(ti.i32)
        place.place(self.waiting)
        place.dense(ti.j, SIDE * SIDE).place(self.pixel, self.end, self.value)
        place.dense(ti.j, most).place(self.light, self.code)
        self._memory.allocate()

    def take(self, near_misses, seed: int, index: int) -> None:
        """Take one sample for every pixel, as ``ProgressiveRenderer._take_sample`` does."""
        renderer = self.renderer
        self._take(renderer, self.scene, self.integrator, renderer.eye_rays, near_misses, seed, index)

    @ti.kernel
    def _take(
        self,
        renderer: ti.template(),
        scene: ti.template(),
        integrator: ti.template(),
        eye_rays: ti.template(),
        near_misses: ti.template(),
        seed: ti.u32,
        index: ti.u32,
    ):
        for block in range(self.places * runtime.CPU_BLOCK):
            # A block of iterations belongs to one place. Its first iteration takes all tiles of the place in turn.
            c = block // runtime.CPU_BLOCK
            tile = c if block % runtime.CPU_BLOCK == 0 else self.tiles
            while tile < self.tiles:
                self.begin(c)
                first_x, first_y = self.x0 + tile // self.upwards * SIDE, self.y0 + tile % self.upwards * SIDE
                for x in range(first_x, ti.min(first_x + SIDE, self.x1)):
                    for y in range(first_y, ti.min(first_y + SIDE, self.y1)):
                        i, is_taken = renderer.shares.sample_of(x, y, index)
                        if is_taken:
                            begin_counting(near_misses, x, y, integrator)
                            rng = renderer.sampler.start(seed, x, y, i)
                            ray, hit = eye_rays.hit_of(x, y, rng)
                            value = renderer.radiance(scene, integrator, ray, hit, rng)
                            self.end_pixel(c, renderer, x, y, i, value)
                self.streams.trace(c)
                self.add_light(c, renderer, near_misses)
                tile += self.places

    @in_kernels
    def begin(self, c) -> None:
        """Begin a tile in a place."""
        self.place = c
        self._clear(c)

    @ti.func
    def _clear(self, c):
        self.streams.clear(c)
        self.waiting[c] = 0

    @ti.func
    def wait(self, scene: ti.template(), surface, w_i, factor):
        """``visible_radiance``; but if a ray has to be traced, the result is 0, and the light is added later."""
        light = scene.lights.unblocked_far(surface, w_i, factor)
        if light.max() > 0:
            if may_meet(scene.effects, surface, w_i):
                k = self.streams.add(self.place, surface.origin, w_i)
                self.light[self.place, k] = factor * light
                self.code[self.place, k] = code_of_look_up(w_i, light)
                light = tm.vec3(0)
            else:
                note_look_up(w_i, light)
        return light

    @ti.func
    def end_pixel(self, c, renderer: ti.template(), x, y, i, value):
        """Give the sample of a pixel to the film, or let it wait for its rays."""
        rays, k = self.streams.count[c], self.waiting[c]
        rays_before = 0
        if k > 0:
            rays_before = self.end[c, k - 1]
        if rays == rays_before:
            renderer.record(x, y, value, i)
        else:
            self.pixel[c, k] = ti.Vector([x, y, ti.cast(i, ti.i32)])
            self.value[c, k], self.end[c, k] = value, rays
            self.waiting[c] = k + 1

    @ti.func
    def add_light(self, c, renderer: ti.template(), near_misses: ti.template()):
        """Add the light of the rays that nothing blocks to the samples that wait for it."""
        r = 0
        for k in range(self.waiting[c]):
            x, y, i = self.pixel[c, k][0], self.pixel[c, k][1], ti.cast(self.pixel[c, k][2], ti.u32)
            value = self.value[c, k]
            while r < self.end[c, k]:
                if not self.streams.is_blocked(c, r):
                    value += self.light[c, r]
                    count_look_up(near_misses, x, y, self.code[c, r])
                r += 1
            renderer.record(x, y, value, i)
