"""A sample that is taken apart is the same sample, and its rays are counted."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tracer.studies import sample_times
from taichi_tracer.studies.sample_times import Anatomy

SIZE = 24


BRUTE = {"intersector": "brute_force", "triangle_test": "moller_trumbore"}  # what compiles soonest
FORMS = {"brute force": BRUTE, "hierarchy": {}, "plain form": {"fast": False} | BRUTE}


def test_strips_fit_into_memory_and_into_the_budget():
    anatomy = Anatomy.__new__(Anatomy)
    anatomy.columns, anatomy.answers = (0, 1000), SimpleNamespace(shadows=10_000, hits=1000)
    anatomy.counted = np.full((1000, 10), 3), np.ones((1000, 10), int)
    assert anatomy.strips(seconds=0.001, budget=1.0) == [(x, x + 100) for x in range(0, 1000, 100)]
    some = anatomy.strips(seconds=1.0, budget=sample_times.PASSES / 4)
    assert sum(b - a for a, b in some) == pytest.approx(250, abs=sample_times.LEAST_STRIP)
    assert some[-1][1] > 700  # they are spread over the picture


def test_a_renderer_whose_rays_a_student_traces_is_not_taken_apart():
    assert not Anatomy.is_possible.fget(SimpleNamespace(renderer=SimpleNamespace(replaced=("shade_ray",))))
