"""Samples of a whole tile of pixels: first all are shaded, then their look-ups are made, then their rays are traced.

The plain form looks up the light of a direction, and traces its shadow ray, where it needs them. Here, the estimator
(``Waiting``) writes down the direction, and the sample goes on without its light. When
all pixels of a tile are shaded, the light of all directions is looked up (``look_ups``), the rays that would find light
are traced as streams (``shadow_streams``), and what is not blocked is added to the samples. A sample is a sum, so that
it does not matter when its terms are found: the picture has the same bits.

Where the eye rays of sixteen neighbouring pixels hit nothing, nothing is shaded: their directions and their look-ups
are computed together.
"""

import functools
import math
from typing import Any

import taichi as ti
import taichi.math as tm
from taichi.lang import impl

from taichi_tracer.fast.far_light import FarMis, form_class
from taichi_tracer.fast.kept_forms import LONG, Least
from taichi_tracer.fast.lanes import LANES, Turns, lanes
from taichi_tracer.fast.look_ups import LightLanes, LookUps, can_wait_for
from taichi_tracer.fast.pixel_lanes import KeptNumbers, NumberLanes, add_samples, can_add_together, has_points
from taichi_tracer.fast.shadow_streams import shadow_rays
from taichi_tracer.fast.wide_bvh import WideBVH
from taichi_tracer.forms import Form
from taichi_tracer.formulas.heuristics import heuristic
from taichi_tracer.picture.pixel_groups import GROUP, GROUP_BITS, lane_of
from taichi_tracer.picture.progress import Progress
from taichi_tracer.scene_in_kernels import may_meet
from taichi_tracer.system import memory, runtime
from taichi_tracer.system.seams import in_kernels
from taichi_tracer.system.varying import varying

SIDE_BITS = 5
SIDE = 1 << SIDE_BITS  # of a tile, in pixels: its rays are near enough to each other, and they stay in the CPU's cache
GROUPS = (SIDE // GROUP + 1) ** 2  # at most, in a tile
UNTRACED, NOTHING = -1, -2  # in place of the number of a ray: nothing can be in its way; it finds no light
# A picture with so many samples of pixels is taken in tiles from the first one on. Kept tiles take half a second to
# start, and those that the process has used a twentieth.
LEAST = Least(started=400_000, kept=4_000_000)
MANY_SAMPLES, SECONDS_BEFORE = 8, 2.0  # of a call of ``render`` that continues a picture: more calls seem to follow
TILES = Form("samples", "of a tile together, shadow rays in streams", "the picture takes long enough", True)


def is_worth_tiles(progress: Progress, seconds_before: float, seconds_of_others: float = 0.0) -> bool:
    """Whether so much will be rendered that tiles are worth their compilation.

    Args:
        progress: of the present call of ``render``. seconds_before: of earlier calls, for the same picture.
        seconds_of_others: of earlier pictures of the same renderer. Who has waited for long will wait again.
    """
    has_taken_long = seconds_before >= SECONDS_BEFORE or seconds_before + seconds_of_others >= LONG
    is_continued = has_taken_long and (progress.target.spp or 0) >= MANY_SAMPLES
    return (progress.is_speed_known and progress.seconds_left >= LONG) or is_continued


def why_no_tiles(progress: Progress) -> str:
    """Why tiles are not worth their compilation, for receipts."""
    left = progress.seconds_left if progress.samples > 0 else math.nan
    told = "nobody knows yet how long it takes" if math.isnan(left) else f"{left:.1f} s of rendering are left"
    return f"{told}; tiles are worth their compilation from {LONG:g} s on"


def can_take_tiles(renderer, scene, integrator) -> bool:
    """Whether the samples of a renderer can be taken tile by tile: only if each is the plain sum of its terms.

    That is so for the estimators that ``far_light`` has a form of, in scenes whose only light is an environment.
    """
    intersector, lights, effects = scene.ray_intersector, scene.lights, scene.effects
    is_far = len(lights.far) == 1 and can_wait_for(lights.far[0]) and not lights.single
    has_shadows = type(intersector) is WideBVH and effects.blockers != "none"
    is_plain = renderer.fast and not renderer.replaced and runtime.can("lanes")
    if not (is_far and has_shadows and is_plain and renderer.is_random):
        return False
    return form_class(scene, integrator) is not None and not effects.background


@ti.data_oriented
class Waiting:
    """The steps of a form of ``far_light`` whose light waits; ``Tiles`` puts them in front of the form's own.

    Attributes:
        tiles: the ``Tiles`` for which the light waits.
    """

    tiles: Any = None

    @ti.func
    def emitted(self, scene, ray, hit, rng):
        """``Tiles.wait_for_background``, if the ray hits nothing; what it hits emits no light."""
        if not hit.is_hit:
            self.tiles.wait_for_background(ray)
        return tm.vec3(0)

    @ti.func
    def visible_radiance(self, scene, surface, w_i, factor):
        """``Tiles.wait_for_light``."""
        self.tiles.wait_for_light(scene, surface, w_i, factor)
        return tm.vec3(0)

    @in_kernels
    def light_direction(self, scene, surface, xi):
        """(w_i, pdf) of a direction to the light: that of the pixel, if directions were drawn for its group at once."""
        if self.tiles.draws_light:
            return self.tiles.light_lanes.sample(self.tiles.place, self.tiles.lane)
        return scene.lights.from_far.sample_direction(surface.origin, xi)

    @ti.func
    def brdf_direction(self, scene, surface, xi):
        """``Tiles.wait_for_density``."""
        return self.tiles.wait_for_density(surface, xi)


@functools.cache
def waiting_class(form: type) -> type:
    """The class of a form of an integrator, whose light waits; one for all objects, which then share their kernels."""
    return type(f"Waiting{form.__name__}", (Waiting, form), {})


@ti.data_oriented
class Tiles:
    """Takes samples tile by tile.

    Fields of a group of pixels in each place:
        group: its column and its row among the groups of the picture.
        behind: its number among the groups whose rays hit nothing; −1 if one of them hits something.
    Fields of a pixel in each place; its number is sixteen times that of its group, plus its lane:
        value: its sample so far. end: the number of the first term that belongs to the next pixel.
    Fields of a term in each place; its number is that of its look-up:
        factor: by which its light is multiplied.
        leaves: whether the direction leaves a surface, and something may be in its way; then it starts at ``origin``.
        ray: the number of its ray, or ``UNTRACED``, or ``NOTHING``.
        pdf: the density of the BRDF at its direction, if the factor is still to be multiplied by a heuristic of this
            and of the light's density; otherwise −1. It exists only if the estimator has such a heuristic.

    Args:
        renderer: the ``ProgressiveRenderer``.
        scene: a ``SceneInKernels``, with a ``WideBVH``.
        integrator: an integrator for which ``can_take_tiles`` holds.
    """

    def __init__(self, renderer, scene, integrator) -> None:
        self.renderer, self.scene, self.is_of = renderer, scene, (scene, integrator)
        form = form_class(scene, integrator)
        self.integrator = waiting_class(form)(integrator)
        self.integrator.tiles = self
        self.weights = issubclass(form, FarMis)
        renderer.eye_rays.is_long = True
        (self.x0, self.x1), (self.y0, self.y1) = renderer.film.ranges
        across, upwards = -(-(self.x1 - self.x0) // SIDE), -(-(self.y1 - self.y0) // SIDE)
        self.upwards, self.turns = varying(upwards), Turns(across * upwards)
        places, most = self.turns.places, SIDE * SIDE * form.techniques
        self.shadow_rays = shadow_rays(scene.ray_intersector, places, most)
        self.has_groups = getattr(renderer.eye_rays, "has_groups", False)  # as kept hits may have, see ``primary_hits``
        self.has_numbers = self.has_groups and has_points(renderer.sampler)
        if self.has_numbers:
            pairs = 2 if integrator.samples_lights else 1
            self.numbers = NumberLanes(renderer.sampler, renderer.shares, pairs, places)
        self.draws_light = self.has_numbers and integrator.samples_lights
        if self.draws_light:
            self.light_lanes = LightLanes(scene.lights.far[0], places)
        self.look_ups = LookUps(scene.lights.far[0], places, most, GROUPS, finds_pdf=self.weights)
        self._memory = memory.Memory(scratch="Tiles")
        place = self._memory.fields.dense(ti.i, places)
        self.groups, self.behind, self.end = (ti.field(ti.i32) for _ in range(3))
        self.value, self.factor, self.origin, self.direction = (ti.Vector.field(3, float) for _ in range(4))
        self.pdf = ti.field(float)
        self.leaves, self.ray = ti.field(ti.i32), ti.field(ti.i32)
        self.group = ti.Vector.field(2, ti.i32)
        place.place(self.groups)
        place.dense(ti.j, GROUPS).place(self.group, self.behind)
        place.dense(ti.j, GROUPS * LANES).place(self.end, self.value)
        place.dense(ti.j, most).place(self.factor, self.leaves, self.origin, self.direction, self.ray)
        self.watch_terms(place, most)
        place.dense(ti.j, most if self.weights else 1).place(self.pdf)
        self._memory.allocate()

    def take(self, seed: int, index: int) -> None:
        """Take one sample for every pixel, as ``ProgressiveRenderer._take_samples`` does."""
        self._take(self.renderer.sample_parts(self.scene, self.integrator), seed, index)

    @ti.kernel
    def _take(self, of: ti.template(), seed: ti.u32, index: ti.u32):
        self.turns.begin()
        for iteration in range(self.turns.iterations):
            c, tile = self.turns.place_and_piece(iteration)
            while tile < self.turns.pieces:
                self.begin(c)
                first_x, first_y = self.x0 + tile // self.upwards * SIDE, self.y0 + tile % self.upwards * SIDE
                end_x, end_y = ti.min(first_x + SIDE, self.x1), ti.min(first_y + SIDE, self.y1)
                # Pixels come in groups, which are those whose eye rays are kept side by side.
                for group_x in range(first_x >> GROUP_BITS, (end_x + GROUP - 1) >> GROUP_BITS):
                    for group_y in range(first_y >> GROUP_BITS, (end_y + GROUP - 1) >> GROUP_BITS):
                        if not of.shares.takes_group(group_x, group_y, index):
                            continue
                        if self.begin_group(c, of.eye_rays, group_x, group_y):
                            continue
                        self.find_numbers(c, group_x, group_y, seed, index)
                        low_x, low_y = group_x << GROUP_BITS, group_y << GROUP_BITS
                        for x in range(ti.max(low_x, first_x), ti.min(low_x + GROUP, end_x)):
                            for y in range(ti.max(low_y, first_y), ti.min(low_y + GROUP, end_y)):
                                i, is_taken = of.shares.sample_of(x, y, index)
                                if is_taken:
                                    rng = self.begin_numbers(c, of.sampler, seed, x, y, i)
                                    ray, hit = of.eye_rays.hit_of(x, y, rng)
                                    value = of.integrator.radiance(of.scene, ray, hit, rng)
                                    self.end_pixel(c, x, y, value)
                self.find_light(c)
                self.shadow_rays.trace(c)
                first, end = tm.ivec2(first_x, first_y), tm.ivec2(end_x, end_y)
                self.end_groups(c, of, first, end, index)
                tile = self.turns.next_piece()

    @ti.func
    def begin_group(self, c, eye_rays: ti.template(), group_x, group_y):
        """Begin a group. Returns whether the eye rays of all its pixels hit nothing.

        If so, what is behind them is looked up later.
        """
        behind = -1
        if ti.static(self.has_groups):
            if eye_rays.hits_nothing(group_x, group_y):
                behind = self.look_ups.groups[c]
                self.look_ups.add_group(c, *eye_rays.directions_of(group_x, group_y))
        g = self.groups[c]
        self.group[c, g], self.behind[c, g] = tm.ivec2(group_x, group_y), behind
        self.groups[c] = g + 1
        return behind >= 0

    @ti.func
    def find_numbers(self, c, group_x, group_y, seed, index):
        """Find the random numbers of a group, and its directions to the light, if they can be computed together."""
        if ti.static(self.has_numbers):
            self.numbers.find(c, group_x, group_y, seed, index)
            if ti.static(self.draws_light):
                self.light_lanes.find(c, self.numbers.first[c, 1], self.numbers.second[c, 1])

    @in_kernels
    def begin_numbers(self, c, sampler, seed, x, y, index):
        """The random numbers of a pixel."""
        rng = sampler.start(seed, x, y, index)
        if not self.has_numbers:
            return rng
        self.lane = lane_of(x, y)
        return KeptNumbers(self.numbers, rng, c, self.lane)

    @in_kernels
    def begin(self, c) -> None:
        """Begin a tile in a place."""
        self.place, self.pdf_brdf = c, impl.expr_init(-1.0)
        self._clear(c)

    @ti.func
    def _clear(self, c):
        self.look_ups.clear(c)
        self.shadow_rays.clear(c)
        self.groups[c] = 0

    @ti.func
    def wait_for_light(self, scene: ti.template(), surface, w_i, factor):
        """Note what ``SceneLights.visible`` would look up, so that its light is added later."""
        if factor.max() > 0 and tm.dot(surface.geometric_normal, w_i) > 0:
            c = self.place
            k = self.look_ups.add(c, w_i)
            self.factor[c, k] = factor
            self.term_waits(c, k)
            if ti.static(self.weights):
                self.pdf[c, k] = self.pdf_brdf
            self.origin[c, k], self.direction[c, k] = surface.origin, w_i
            self.leaves[c, k] = ti.cast(may_meet(scene.effects, surface, w_i), ti.i32)
        if ti.static(self.weights):
            self.pdf_brdf = -1.0

    @ti.func
    def wait_for_background(self, ray):
        """Note the direction of a ray that hits nothing, so that its light is added later."""
        c = self.place
        k = self.look_ups.add(c, ray.direction)
        self.factor[c, k], self.leaves[c, k] = tm.vec3(1), 0
        self.term_waits(c, k)
        if ti.static(self.weights):
            self.pdf[c, k] = -1.0

    @ti.func
    def wait_for_density(self, surface, xi):
        """``FarMis.brdf_direction`` without the heuristic, which needs the density of the light."""
        w_i = surface.sample(xi)
        self.pdf_brdf = surface.pdf(w_i)
        return w_i, surface.weight(w_i)

    @ti.func
    def end_pixel(self, c, x, y, value):
        """Let the sample of a pixel wait for its terms."""
        k = (self.groups[c] - 1) * LANES + lane_of(x, y)
        self.value[c, k], self.end[c, k] = value, self.look_ups.count[c]

    @ti.func
    def find_light(self, c):
        """Look up the light of all terms, and send a ray for those that find some, if anything may be in its way."""
        self.look_ups.find(c)
        for k in range(self.look_ups.count[c]):
            light, factor = self.look_ups.light_of[c, k], self.factor[c, k]
            if ti.static(self.weights):
                if self.pdf[c, k] >= 0:
                    factor *= heuristic(self.pdf[c, k], self.look_ups.pdf_of[c, k], self.integrator.plain.exponent)
            ray = NOTHING
            if factor.max() > 0 and light.max() > 0:
                ray = UNTRACED
                if self.leaves[c, k] != 0:
                    ray = self.shadow_rays.add(c, self.origin[c, k], self.direction[c, k])
            self.term_is_found(c, k, factor, light)
            self.ray[c, k], self.factor[c, k] = ray, factor * light

    @ti.func
    def end_groups(self, c, of: ti.template(), first, end, index):
        """Add the light of the terms that nothing blocks to their samples, and give these to the film.

        Args:
            first, end: the pixels of the tile lie between them, ``end`` excluded.
        """
        term = 0
        for g in range(self.groups[c]):
            low, behind = self.group[c, g] << GROUP_BITS, self.behind[c, g]
            is_whole = (low >= first).all() and (low + GROUP <= end).all()
            red, green, blue = lanes(0.0), lanes(0.0), lanes(0.0)
            for lane in range(LANES):
                x, y = low.x + lane // GROUP, low.y + lane % GROUP
                _, is_taken = self.sample_of(of.shares, x, y, is_whole, first, end, index)
                if is_taken:
                    value = tm.vec3(0)
                    if behind >= 0:
                        k = self.look_ups.number_in_group(behind, lane)
                        value = self.look_ups.look_up(c, k)
                        self.background_is_added(c, k, x, y, value)
                    else:
                        value = self.value[c, g * LANES + lane]
                        while term < self.end[c, g * LANES + lane]:
                            if self.is_seen(c, term):
                                value += self.factor[c, term]
                                self.term_is_added(c, term, x, y)
                            term += 1
                    red[lane], green[lane], blue[lane] = value.x, value.y, value.z
            are_added = False
            if ti.static(can_add_together(of.film)):
                if is_whole:
                    are_added = add_samples(of.film, *self.group[c, g], index, red, green, blue)
            if not are_added:
                for lane in range(LANES):
                    x, y = low.x + lane // GROUP, low.y + lane % GROUP
                    i, is_taken = self.sample_of(of.shares, x, y, is_whole, first, end, index)
                    if is_taken:
                        self.renderer.record(x, y, tm.vec3(red[lane], green[lane], blue[lane]), i)

    @ti.func
    def sample_of(self, shares: ti.template(), x, y, is_whole, first, end, index):
        """``Shares.sample_of`` for a pixel that may lie outside the tile, unless its group ``is_whole``."""
        i, is_taken = index, False
        if is_whole or (first.x <= x and x < end.x and first.y <= y and y < end.y):
            i, is_taken = shares.sample_of(x, y, index)
        return i, is_taken

    @ti.func
    def is_seen(self, c, term):
        """Whether nothing blocks the light of a term."""
        ray = self.ray[c, term]
        is_seen = ray == UNTRACED
        if ray >= 0:
            is_seen = not self.shadow_rays.is_blocked(c, ray)
        return is_seen

    # ── for who watches: ``watched_tiles`` ──

    def watch_terms(self, place: ti.SNode, most: int) -> None:
        """Place fields of the terms, of which there are at most so many."""

    @ti.func
    def term_waits(self, c, k):
        """The sample of a pixel has written down term k."""

    @ti.func
    def term_is_found(self, c, k, factor, light):
        """Term k has found its light, by which its factor is to be multiplied."""

    @ti.func
    def term_is_added(self, c, k, x, y):
        """Nothing blocks term k: it is added to the sample of a pixel."""

    @ti.func
    def background_is_added(self, c, k, x, y, light):
        """Look-up k has found what is behind a pixel whose ray hits nothing."""
