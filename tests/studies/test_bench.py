"""A bench renders ranges of a picture, which add up to the picture that it renders alone."""

import numpy as np
import pytest
from support import start

from taichi_tracer.studies.bench import Bench
from taichi_tracer.studies.source import Source
from taichi_tracer.studies.variants import Variant

SIZE = 12, 8


@pytest.mark.exhaustive
def test_ranges_from_elsewhere_add_up_to_the_bits_of_one_picture():
    start("f32")
    variant = Variant("brdf", triangle_test="watertight", intersector="brute_force")
    here, there = (Bench(Source("cube", "studio"), "cpu") for _ in range(2))
    there.is_started = here.is_started = True
    alone = here.render(variant, SIZE, 20, 7, "variance")
    first = here.render(variant, SIZE, 5, 7, "variance")
    assert first.samples == 5
    parts = [(end - begin, there.take(variant, SIZE, 7, begin, end - begin)) for begin, end in ((5, 6), (6, 16))]
    assert here.add(variant, SIZE, parts).samples == 16
    shared = here.render(variant, SIZE, 4, None, "variance")  # it goes on after them
    assert shared.samples == 20
    np.testing.assert_array_equal(shared.image, alone.image)
    np.testing.assert_array_equal(shared.variance, alone.variance)
    assert float(shared.error) == float(alone.error)
