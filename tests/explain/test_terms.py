"""The terms of a sample add up to its value, their factors are those of the formulas, and what is missing is told."""

import math

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import start

import taichi_tracer as tt
from taichi_tracer.explain.explanation import (
    COS,
    F_R,
    NO_RAY,
    OF_BRDF,
    OF_LIGHTS,
    OF_ONE,
    OWN,
    PDF_BRDF,
    PDF_LIGHTS,
    PDF_ONE,
    RATIO,
    THROUGHPUT,
    WEIGHT,
    Step,
    terms_of,
)

SIZE = (24, 16)
UP, ONE = np.array([0, 1.0, 0]), np.ones(3)
SLANTED = np.array([0.6, 0.8, 0])
CLASSES = {"path": tt.A4Renderer, "explicit": tt.A4Renderer, "implicit": tt.A4Renderer}
SCENES = {"cornell_box": {}, "cube": {"environment": "studio"}, "caustic_sphere": {}, "rt3/all_lights": {}}
EVERY = [pytest.param("cube", "mis", marks=pytest.mark.slow), ("cornell_box", "path")]


@pytest.mark.parametrize(("scene_name", "name"), EVERY)
def test_the_terms_add_up_to_the_value_of_the_sample(scene_name, name):
    start("f32")
    scene = tt.load_scene_data(scene_name, **SCENES[scene_name])
    renderer = CLASSES.get(name, tt.A3Renderer)(scene, *SIZE).use(name)
    rng, bright, hits = np.random.default_rng(5), 0, 0
    for sample in range(6):
        column, row = int(rng.integers(4, 20)), int(rng.integers(2, 14))
        found = renderer.explain(column, row, None if sample % 2 else sample, 50)  # half of them are unusual
        values = [term.value for term in found.terms]
        assert np.allclose(np.sum(values, axis=0), found.value, rtol=1e-5, atol=1e-5 * np.max(np.abs(values)))
        assert not found.remainder.any(), str(found)
        for term in found.terms:
            check_factors(term, name)
        reflected = [term for term in found.terms if term.surface > 0]
        hits += len(reflected)
        bright += sum(term.value.max() > 0 for term in reflected)
        assert "= " in found.equation[1]
    assert hits >= 6
    assert bright > 0
    scene.destroy()


@ti.data_oriented
class Half(tt.Integrator):
    """An integrator that asks nothing of the scene."""

    name, what = "half", "estimator"

    @ti.func
    def radiance(self, scene, ray, hit, rng):
        return tm.vec3(0.5)


def test_a_value_without_terms_is_all_remainder(f32):
    renderer = tt.A3Renderer(tt.load_scene_data("cornell_box"), *SIZE, integrator=Half())
    np.testing.assert_array_equal(renderer.explain(3, 3).remainder, [0.5, 0.5, 0.5])


def check_factors(term, name):
    """f_r cos / pdf has no MIS weight in it, and is what f_r, the cosine and the density come to."""
    numbers, ratio = term.numbers, term.factors.get(RATIO)
    is_delta = term.how == OF_BRDF and F_R not in numbers
    if ratio is None or is_delta or "behind" in term.why or "dark" in term.why:
        return
    pdf = numbers.get({OF_BRDF: PDF_BRDF, OF_LIGHTS: PDF_LIGHTS, OF_ONE: PDF_ONE}.get(term.how))
    if term.how == OWN:
        pdf = 1 / (4 * math.pi) if name == "uniform" else 1 / (2 * math.pi)
    if pdf > 0:
        assert np.allclose(ratio, numbers[F_R] * max(0.0, numbers[COS]) / pdf, rtol=1e-3, atol=1e-6), term
    if name in ("mis", "path") and pdf > 0 and term.how != OF_ONE:
        other = numbers.get(PDF_LIGHTS if term.how == OF_BRDF else PDF_BRDF, 0.0)
        assert term.factors[WEIGHT] == pytest.approx(pdf**2 / (pdf**2 + other**2), rel=1e-3, abs=1e-6)


def surface():
    return Step("surface", {"normal": UP, "is_delta": 0.0})


def brdf_sample(light, survival=None):
    """The steps of a direction from the BRDF: f_r cos / pdf is 1/2."""
    steps = [
        Step(OF_BRDF, {"w_i": SLANTED}),
        Step("f_r", {"w_i": SLANTED, "f_r": 0.25 * ONE}),
        Step("the BRDF's density", {"w_i": SLANTED, "pdf": 0.4}),
        Step("f_r cos / pdf", {"w_i": SLANTED, "f_cos_over_pdf": 0.5 * ONE}),
    ]
    if survival is not None:
        steps.append(Step("Russian roulette", {"survival": survival}))
    return [*steps, *([] if light is None else [Step("light that arrives", {"L_i": light * ONE})])]


EMITTED = Step("emitted", {"L_e": 0.5 * ONE})


def test_the_throughput_is_passed_on_with_the_roulette_in_it():
    steps = [EMITTED, surface(), *brdf_sample(0.0, survival=0.5), surface(), *brdf_sample(3.0)]
    seen, first, second = terms_of(steps, lambda pdf, other: None)
    assert seen.value.tolist() == [0.5] * 3
    assert first.why == "no light arrives from there"
    assert second.factors[THROUGHPUT].tolist() == [1] * 3
    assert second.value.tolist() == [1.5] * 3
    assert second.numbers[COS] == 0.8
    assert WEIGHT not in second.factors


def test_why_a_path_ends_is_told():
    ended = terms_of([EMITTED, surface(), *brdf_sample(None, survival=0.5)], lambda pdf, other: None)
    assert ended[1].why == "Russian roulette ends the path"
    assert terms_of([EMITTED, surface(), *brdf_sample(None)], lambda pdf, other: None)[1].why == NO_RAY


def test_bounces_that_do_not_count_have_the_factor_0():
    steps = [EMITTED, surface(), *brdf_sample(3.0), Step("bounces that count", {"depth": 1.0, "counts": 0.0})]
    assert [term.value.max() for term in terms_of(steps, lambda pdf, other: None)] == [0.5, 0]
