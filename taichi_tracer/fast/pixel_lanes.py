"""What sixteen neighbouring pixels compute at once: their eye rays, their random numbers, and their sums in the film.

The bits are those of ``generate_ray``, of ``RandomNumbers`` and of ``Film.add``. A pair of random numbers, or a sample
that is added to its pixel, is a chain of operations, each of which waits for the one before it, and the same chain for
every pixel. Of a loop over pixels that only reads and writes variables of the kernel, LLVM makes vector instructions:
eight pixels take hardly longer than one.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.camera import Camera
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.fast.lanes import LANES, flags, lanes
from taichi_tracer.fast.packets import TILE
from taichi_tracer.picture.exact_sums import add_to_pair
from taichi_tracer.picture.film import Film
from taichi_tracer.picture.pixel_groups import GROUP, GROUP_BITS
from taichi_tracer.picture.pixel_sums import is_finite, mean_of_channels
from taichi_tracer.random_numbers import TERM_BIT, RandomNumbers
from taichi_tracer.system import memory
from taichi_tracer.system.seams import replaced

FIRST_DIMENSION = 0  # the dimension of the sampler that belongs to the pixel


class PerspectiveLanes:
    """Rays of ``Camera``; all of them start at the eye."""

    share_origin = True

    @staticmethod
    @ti.func
    def rays_through(camera: ti.template(), x, y):
        """Components of the common origin and of the directions, for several points of the image plane."""
        m = camera.camera_to_world[None]
        dx = m[0, 0] * x + m[0, 1] * y + m[0, 2]
        dy = m[1, 0] * x + m[1, 1] * y + m[1, 2]
        dz = m[2, 0] * x + m[2, 1] * y + m[2, 2]
        scale = 1 / ti.sqrt(dx * dx + dy * dy + dz * dz)
        return m[0, 3], m[1, 3], m[2, 3], dx * scale, dy * scale, dz * scale


class OrthographicLanes:
    """Rays of ``OrthographicCamera``; all of them have the same direction."""

    share_origin = False

    @staticmethod
    @ti.func
    def rays_through(camera: ti.template(), x, y):
        """Components of the origins and of the common direction, for several points of the image plane."""
        m = camera.camera_to_world[None]
        ox = m[0, 0] * x + m[0, 1] * y + m[0, 3]
        oy = m[1, 0] * x + m[1, 1] * y + m[1, 3]
        oz = m[2, 0] * x + m[2, 1] * y + m[2, 3]
        return ox, oy, oz, m[0, 2], m[1, 2], m[2, 2]


STAND_INS = {Camera: PerspectiveLanes, OrthographicCamera: OrthographicLanes}


def lanes_of(camera):
    """The class with the rays of a camera; None if one of the camera's methods was replaced."""
    if replaced(camera):
        return None
    return next((STAND_INS[cls] for cls in type(camera).__mro__ if cls in STAND_INS), None)


@ti.func
def generate_rays(form: ti.template(), camera: ti.template(), pixel_x, pixel_y, xi_x, xi_y):
    """``generate_ray`` through the points ξ of several pixels: six components, each a vector or one common number."""
    half, centre = camera.half_size[None], camera.centre[None]
    x = (2 * (pixel_x + xi_x) / camera.width - 1) * half.x + centre.x
    y = (2 * (pixel_y + xi_y) / camera.height - 1) * half.y + centre.y
    return form.rays_through(camera, x, y)


def has_points(sampler) -> bool:
    """Whether a sampler's pairs can be computed in lanes: it defines ``point``, and none of its methods is replaced."""
    return hasattr(sampler, "point") and not replaced(sampler)


@ti.func
def pairs_of(sampler: ti.template(), shares: ti.template(), low_x, low_y, seed, index, dimension):
    """The pair of one dimension for a group of 4 × 4 pixels: (their first numbers, their second numbers), in lanes.

    Beyond the picture, they are those of the nearest pixel.

    Args:
        low_x, low_y: the lowest column and row of the group.
        index: the index of the present pass; ``shares`` says which sample of a pixel this is.
    """
    first, second = lanes(0.0), lanes(0.0)
    for lane in range(LANES):
        x, y = ti.min(low_x + lane // TILE, sampler.width - 1), ti.min(low_y + lane % TILE, sampler.height - 1)
        sample, _ = shares.sample_of(x, y, index)
        pixel = sampler.pixel_number(x, y)
        first[lane], second[lane] = sampler.point(seed, pixel, sample, ti.u32(dimension))
    return first, second


@ti.data_oriented
class NumberLanes:
    """The pairs that a sample of direct light takes, for a group of 4 × 4 pixels in each place.

    ``first`` and ``second`` are the numbers of a pair of all pixels of a group. The pairs have the dimensions that
    ``RandomNumbers`` gives them behind that of the pixel: first that of ``next_2d_of_term``, then that of ``next_2d``,
    if the estimator takes it.

    Args:
        sampler: a sampler that ``has_points``. shares: the ``Shares`` of the picture.
        pairs: how many pairs a sample takes, 1 or 2. places: the number of threads.
    """

    def __init__(self, sampler, shares, pairs: int, places: int) -> None:
        self.sampler, self.shares = sampler, shares
        first = FIRST_DIMENSION + 1
        dimensions = (first | 1 << TERM_BIT, first) if sampler.shares_terms else (first, first + 1)
        self._scratch, self._memory = memory.Memory(scratch="NumberLanes"), memory.Memory()
        self.first, self.second = (ti.Vector.field(LANES, float) for _ in range(2))
        self.pairs, self.dimension = ti.field(ti.i32), ti.field(ti.u32)
        with self._scratch as fields:
            fields.dense(ti.i, places).dense(ti.j, pairs).place(self.first, self.second)
        with self._memory as fields:
            fields.place(self.pairs)
            fields.dense(ti.i, pairs).place(self.dimension)
        self._memory.write(self.pairs, pairs)
        self._memory.write(self.dimension, np.array(dimensions[:pairs], np.uint32))

    @ti.func
    def find(self, c, group_x, group_y, seed, index):
        """Compute the pairs of the pixels of a group. Beyond the picture, they are those of the nearest pixel."""
        low_x, low_y = group_x * TILE, group_y * TILE
        for k in range(self.pairs[None]):  # a length that LLVM does not know, so that it writes the loop only once
            first, second = pairs_of(self.sampler, self.shares, low_x, low_y, seed, index, self.dimension[k])
            self.first[c, k], self.second[c, k] = first, second

    @ti.func
    def pair(self, c, k: ti.template(), lane):
        """Pair k of a pixel; lanes are those of ``PrimaryHits.tile_and_lane``."""
        return tm.vec2(self.first[c, k][lane], self.second[c, k][lane])


class KeptNumbers:
    """``RandomNumbers`` of a pixel whose pairs are in ``NumberLanes``, for ``next_2d_of_term`` and then ``next_2d``.

    A handout's method that draws its numbers itself (``sampler.given_or_drawn``) takes them from ``rng``. Therefore
    ``rng`` counts the pairs, too, as it would without lanes.
    """

    _data_oriented = True  # allows kernels to keep it in a variable and to pass it to functions

    def __init__(self, numbers: NumberLanes, rng: RandomNumbers, c, lane) -> None:
        self.numbers, self.rng, self.c, self.lane = numbers, rng, c, lane

    @ti.func
    def next_2d_of_term(self):
        """Two numbers in [0, 1)."""
        self.rng.count_term()
        return self.numbers.pair(self.c, 0, self.lane)

    @ti.func
    def next_2d(self):
        """Two numbers in [0, 1)."""
        self.rng.skip_2d()
        return self.numbers.pair(self.c, 1, self.lane)

    @ti.func
    def skip_2d(self):
        """Skip the pair of the next dimension."""
        self.rng.skip_2d()


def can_add_together(film: Film) -> bool:
    """Whether a film only adds samples up: it keeps no deviations, whose formula needs the mean of each pixel."""
    return film.halves == 2 and not film.keeps_deviation


@ti.func
def add_samples(film: ti.template(), group_x, group_y, sample, red, green, blue):
    """Add a sample to each pixel of a group, if all are finite and belong to the same half. Returns whether it did.

    Args:
        film: a film that ``can_add_together``.
        group_x, group_y: column and row of the group among the ``PixelGroups``.
        sample: the index of the samples. red, green, blue: their values.
    """
    counts = film.count.lanes[0][group_x, group_y, 0]
    n = counts[0]
    half = ti.cast(sample, ti.i32) & 1
    if ti.static(film.doubles):
        half = ti.select(n > 0, 1, 0)
    total_r, rest_r = film.total.lanes[0][group_x, group_y, half], film.rest.lanes[0][group_x, group_y, half]
    total_g, rest_g = film.total.lanes[1][group_x, group_y, half], film.rest.lanes[1][group_x, group_y, half]
    total_b, rest_b = film.total.lanes[2][group_x, group_y, half], film.rest.lanes[2][group_x, group_y, half]
    lost_r, lost_g, lost_b = lanes(0.0), lanes(0.0), lanes(0.0)
    largest = film.largest.lanes[0][group_x, group_y, 0]
    is_alike, has_lost = flags(0), flags(0)
    for lane in range(LANES):
        value = tm.vec3(red[lane], green[lane], blue[lane])
        total_r[lane], rest_r[lane], lost_r[lane] = add_to_pair(total_r[lane], rest_r[lane], value.x)
        total_g[lane], rest_g[lane], lost_g[lane] = add_to_pair(total_g[lane], rest_g[lane], value.y)
        total_b[lane], rest_b[lane], lost_b[lane] = add_to_pair(total_b[lane], rest_b[lane], value.z)
        largest[lane] = ti.max(largest[lane], mean_of_channels(value))
        is_alike[lane] = ti.cast(is_finite(value), ti.i32)
        if ti.static(film.doubles):
            is_alike[lane] &= ti.cast(counts[lane] == n, ti.i32)
        has_lost[lane] = ti.cast(abs(tm.vec3(lost_r[lane], lost_g[lane], lost_b[lane])).sum() > 0, ti.i32)
    are_added = is_alike.min() != 0
    if ti.static(film.doubles):
        # At a power of two, half 1 may have to become a part of half 0: ``PixelSums.begin_doubling``.
        are_added = are_added and n & (n - 1) != 0
    if are_added:
        film.total.lanes[0][group_x, group_y, half], film.rest.lanes[0][group_x, group_y, half] = total_r, rest_r
        film.total.lanes[1][group_x, group_y, half], film.rest.lanes[1][group_x, group_y, half] = total_g, rest_g
        film.total.lanes[2][group_x, group_y, half], film.rest.lanes[2][group_x, group_y, half] = total_b, rest_b
        film.largest.lanes[0][group_x, group_y, 0] = largest
        film.count.lanes[0][group_x, group_y, 0] = counts + 1
        film.half_count.lanes[0][group_x, group_y, half] = film.half_count.lanes[0][group_x, group_y, half] + 1
        if has_lost.max() != 0:
            for lane in range(LANES):
                x, y = (group_x << GROUP_BITS) + lane // GROUP, (group_y << GROUP_BITS) + lane % GROUP
                film.add_lost(x, y, half, tm.vec3(lost_r[lane], lost_g[lane], lost_b[lane]))
    return are_added
