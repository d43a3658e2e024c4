"""A sample that is taken apart is the same sample, and its rays are counted."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tracer.studies import sample_times
from taichi_tracer.studies.sample_times import RECORD, REPLAY_ALL, Anatomy

SIZE = 24


BRUTE = {"intersector": "brute_force", "triangle_test": "moller_trumbore"}  # what compiles soonest
FORMS = {"brute force": BRUTE, "hierarchy": {}, "plain form": {"fast": False} | BRUTE}


def test_answers_that_are_read_give_the_same_bits(anatomy):
    renderer = anatomy.renderer
    wanted = renderer.render().image().copy()
    renderer.begin_anew()
    renderer.render()
    rays = anatomy.count()
    assert rays.eye == SIZE**2
    assert 0.5 * rays.eye < rays.shadow < 8 * rays.eye
    assert 0.5 * rays.eye < rays.others < 8 * rays.eye
    renderer.begin_anew()
    renderer.render()
    anatomy.place(anatomy.columns)
    anatomy.run(anatomy.columns, RECORD, fills_film=False)
    anatomy.run(anatomy.columns, REPLAY_ALL)
    renderer.film.samples += 1
    assert np.array_equal(renderer.image(), wanted)


def test_the_parts_add_up_and_the_picture_begins_again(anatomy):
    parts = anatomy.measure(budget=10.0)
    assert parts.share == 1
    assert parts.film + parts.rays + parts.eye + parts.shading == pytest.approx(max(parts.whole, parts.rays))
    assert (parts.eye > 0) <= anatomy.traces_eye_rays
    assert anatomy.renderer.samples == 0 or not anatomy.renderer.is_current()


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
