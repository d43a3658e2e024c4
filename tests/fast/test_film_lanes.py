"""Samples of sixteen pixels that are added at once: the film is the same to the last bit."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

from taichi_tracer.fast.lanes import LANES, lanes
from taichi_tracer.fast.pixel_lanes import add_samples, can_add_together
from taichi_tracer.picture.film import Film
from taichi_tracer.picture.pixel_groups import GROUP

WIDTH, HEIGHT, SAMPLES = 8, 4, 19
KINDS = [{"replicated": True}, {"doubles": True}]


@ti.data_oriented
class Both:
    """The same samples on two films: given one by one, and in groups wherever that is possible."""

    def __init__(self, kind):
        self.alone, self.together = Film(WIDTH, HEIGHT, **kind), Film(WIDTH, HEIGHT, **kind)
        self.values = ti.Vector.field(3, float, (WIDTH, HEIGHT))
        self.added = ti.field(ti.i32, (WIDTH // GROUP, HEIGHT // GROUP))

    def add(self, values, sample):
        """(width, height, 3) values; returns which groups were added at once."""
        self.values.from_numpy(values.astype(np.float32))
        self._add(sample)
        return self.added.to_numpy() != 0

    @ti.kernel
    def _add(self, sample: ti.u32):
        for x, y in self.values:
            self.alone.add(x, y, self.values[x, y], sample)
        for group_x, group_y in self.added:
            red, green, blue = lanes(0.0), lanes(0.0), lanes(0.0)
            for lane in range(LANES):
                value = self.values[group_x * GROUP + lane // GROUP, group_y * GROUP + lane % GROUP]
                red[lane], green[lane], blue[lane] = value.x, value.y, value.z
            is_added = add_samples(self.together, group_x, group_y, sample, red, green, blue)
            self.added[group_x, group_y] = ti.cast(is_added, ti.i32)
            if not is_added:
                for lane in range(LANES):
                    x, y = group_x * GROUP + lane // GROUP, group_y * GROUP + lane % GROUP
                    self.together.add(x, y, tm.vec3(red[lane], green[lane], blue[lane]), sample)

    def assert_same(self):
        first, second = self.alone.to_arrays(), self.together.to_arrays()
        assert first.keys() == second.keys()
        for name, array in first.items():
            np.testing.assert_array_equal(array, second[name], err_msg=name)


def some_values(rng):
    """Values that differ by so many powers of ten that the sums have rests and residues."""
    return rng.lognormal(size=(WIDTH, HEIGHT, 3)) * 10 ** rng.uniform(-12, 12, (WIDTH, HEIGHT, 1))


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_the_same_film(f32, rng, kind):
    both = Both(kind)
    added = np.array([both.add(some_values(rng), sample) for sample in range(SAMPLES)])
    both.assert_same()
    assert "residues" in both.together.to_arrays()
    doubled = {0, 1, 2, 4, 8, 16} if "doubles" in kind else set()  # the numbers of samples at which halves may change
    assert {k for k in range(SAMPLES) if not added[k].all()} == doubled


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_a_group_with_a_sample_that_is_no_number_is_left_to_its_pixels(f32, rng, kind):
    both = Both(kind)
    for sample in range(5):
        both.add(some_values(rng), sample)
    values = some_values(rng)
    values[5, 2, 1] = np.nan
    assert both.add(values, 5).ravel().tolist() == [True, False]
    assert both.together.non_finite == 1
    np.testing.assert_array_equal(both.add(some_values(rng), 6).ravel(), [True, "replicated" in kind])
    both.assert_same()


def test_films_with_deviations_add_one_by_one(f32):
    assert [can_add_together(Film(4, 4, **kind)) for kind in (*KINDS, {})] == [True, True, False]
    assert not can_add_together(Film(4, 4, replicated=True, keeps_deviation=True))
