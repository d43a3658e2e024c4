"""Samples of sixteen neighbouring pixels that are given to the film at once, with the same bits as ``Film.add``.

A sample is added to its pixel by a chain of operations, each of which waits for the one before it, and by the same
chain for every pixel. Of a loop that only reads and writes variables of the kernel, LLVM makes vector instructions.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, flags, lanes
from taichi_tracer.picture.exact_sums import add_to_pair
from taichi_tracer.picture.film import Film
from taichi_tracer.picture.pixel_groups import GROUP, GROUP_BITS
from taichi_tracer.picture.pixel_sums import is_finite, mean_of_channels


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
