"""The sums of a picture's samples: for every pixel and each half of its samples, exact to three times the precision."""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.picture.exact_sums import add_to_pair, exact_total
from taichi_tracer.picture.pixel_groups import PixelGroups, groups_along
from taichi_tracer.system.memory import Memory


@ti.data_oriented
class PixelSums:
    """Numbers of samples and their sums. ``Film`` says what the halves are, and what its fields contain."""

    width: int
    height: int
    halves: int
    doubles: bool
    memory: Memory

    def place_sums(self) -> None:
        """Make the fields, in ``memory``."""
        shape, groups = (self.width, self.height), (groups_along(self.width), groups_along(self.height))
        pixel = self.memory.fields.dense(ti.k, 1).dense(ti.ij, groups)
        self.count = PixelGroups(pixel, *shape, 1, ti.i32)
        if self.halves == 2:
            self.largest = PixelGroups(pixel, *shape)
        if self.doubles:
            self.before = PixelGroups(pixel, *shape, 3)
        # In memory, the two halves of the picture lie apart. A pass over all pixels writes to only one half; then the
        # memory of the other half need not be written back.
        half = self.memory.fields.dense(ti.k, self.halves).dense(ti.ij, groups)
        self.half_count = PixelGroups(half, *shape, 1, ti.i32)
        self.total, self.rest = (PixelGroups(half, *shape, 3) for _ in range(2))
        self.residue = ti.Vector.field(3, float)  # apart, because it is seldom read
        self.memory.fields.dense(ti.k, self.halves).dense(ti.ij, shape).place(self.residue)

    @ti.func
    def half_of(self, x, y, sample):
        """The half to which a sample is added."""
        half = ti.cast(sample, ti.i32) & ti.static(self.halves - 1)
        if ti.static(self.doubles):
            self.begin_doubling(x, y)
            half = ti.select(self.count.number(x, y, 0) > 0, 1, 0)
        return half

    @ti.func
    def begin_doubling(self, x, y):
        """Where the number of samples is a power of two, half 1 becomes a part of half 0, for the samples to come."""
        n = self.count.number(x, y, 0)
        if n & (n - 1) == 0 and self.half_count.number(x, y, 1) > 0:
            self.before.set_colour(x, y, 0, self.exact_half(x, y, 0) / self.half_count.number(x, y, 0))
            self.move_half(self, x, y, 1, 0)
            self.clear_half(x, y, 1)
            self.count.set_number(x, y, 0, n)

    @ti.func
    def add_to_half(self, x, y, half, value):
        """Add a number to the sum of one half of a pixel."""
        total, rest, lost = add_to_pair(self.total.colour(x, y, half), self.rest.colour(x, y, half), value)
        self.total.set_colour(x, y, half, total)
        self.rest.set_colour(x, y, half, rest)
        self.add_lost(x, y, half, lost)

    @ti.func
    def add_lost(self, x, y, half, lost):
        """Add to the residue of one half of a pixel."""
        if abs(lost).sum() > 0:  # seldom, so that this memory is mostly left alone
            self.residue[x, y, half] = self.residue[x, y, half] + lost

    @ti.func
    def count_in_half(self, x, y, half, count):
        """Count samples that were added to one half of a pixel."""
        self.half_count.set_number(x, y, half, self.half_count.number(x, y, half) + count)
        self.count.set_number(x, y, 0, self.count.number(x, y, 0) + count)

    @ti.func
    def move_half(self, other: ti.template(), x, y, source, half):
        """Add all samples that one half of a pixel has on another film, or on this one, to a half of this film."""
        for part in range(3):  # a loop that runs in the kernel: the code of ``add_to_half`` is there once
            value = other.residue[x, y, source]
            if part == 0:
                value = other.total.colour(x, y, source)
            elif part == 1:
                value = other.rest.colour(x, y, source)
            self.add_to_half(x, y, half, value)
        self.count_in_half(x, y, half, other.half_count.number(x, y, source))

    @ti.func
    def clear_half(self, x, y, half):
        """Forget the samples of one half of a pixel."""
        self.half_count.set_number(x, y, half, 0)
        for part in ti.static((self.total, self.rest)):
            part.set_colour(x, y, half, tm.vec3(0))
        self.residue[x, y, half] = tm.vec3(0)

    @ti.func
    def mean(self, x, y):
        """The mean of all samples of a pixel; 0 if it has none."""
        total = self.total.colour(x, y, 0)
        for half in ti.static(range(1, self.halves)):
            total += self.total.colour(x, y, half)
        return total / ti.max(self.count.number(x, y, 0), 1)

    @ti.func
    def exact_mean(self, x, y):
        """The same, rounded once from the exact sum of each sequence: it does not depend on the samples' order."""
        total = self.exact_half(x, y, 0)
        if ti.static(self.doubles):
            total = self.exact_sequence(x, y)
        else:
            for half in ti.static(range(1, self.halves)):
                total += self.exact_half(x, y, half)
        return total / ti.max(self.count.number(x, y, 0), 1)

    @ti.func
    def exact_half(self, x, y, half):
        """The sum of one half of a pixel, rounded once."""
        return exact_total(self.total.colour(x, y, half), self.rest.colour(x, y, half), self.residue[x, y, half])

    @ti.func
    def exact_sequence(self, x, y):
        """The sum of both halves of a pixel, rounded once: it does not depend on where one half ends."""
        total, rest, residue = self.total.colour(x, y, 0), self.rest.colour(x, y, 0), self.residue[x, y, 0]
        for part in ti.static((self.total, self.rest)):
            total, rest, lost = add_to_pair(total, rest, part.colour(x, y, 1))
            residue += lost
        total, rest, lost = add_to_pair(total, rest, self.residue[x, y, 1])
        return exact_total(total, rest, residue + lost)

    def counts(self) -> np.ndarray:
        """[x, y] the number of samples of every pixel."""
        return self.count.read(self.memory)[..., 0]


@ti.func
def mean_of_channels(value):
    """The mean of red, green and blue."""
    return (value * ti.static(1 / 3)).sum()


@ti.func
def is_finite(value):
    """Whether all three components are finite."""
    return abs(value).sum() < tm.inf
