"""What a study compares: every knob turned alone, and nothing that cannot be compared."""

import pytest

import taichi_tracer as tt
from taichi_tracer.studies import variants


def test_plans():
    plan = variants.plan(estimators=("brdf", "mis"), samplers=("sobol",))
    assert [(v.estimator, v.sampler, v.difference(plan[0])) for v in plan] == [
        ("brdf", "sobol", ""),
        ("mis", "sobol", "estimator"),
    ]
    usual = variants.plan(fast_math=(False,))
    knobs = [v.difference(usual[0]) for v in usual]
    assert knobs[0] == ""
    assert set(knobs[1:]) == {"estimator", "sampler", "precision", "triangle_test", "lookup", "adaptive", "scale"}
    assert [v.max_bounces for v in variants.plan(max_bounces=(1, 3))] == [3, 1]
    with pytest.raises(tt.InputError, match="unknown sampler 'halton'"):
        variants.plan(samplers=("halton",))
    with pytest.raises(tt.InputError, match="unknown lookup 'simple'"):
        variants.plan(lookups=("simple",))


@pytest.mark.parametrize(
    ("knobs", "message"),
    [
        ({"estimators": ("path", "mis")}, "bounces with path, and not with mis: .* no reference fits both"),
        ({"estimators": ("mis",), "max_bounces": (1, 2)}, "max_bounces is of paths, .* use estimators among implicit"),
        ({"roulettes": ("russian",)}, "unknown roulette 'russian': known are none, throughput, or a number q"),
        ({"roulettes": (1.0,)}, "q must be more than 0 and less than 1, not 1.0"),
        ({"max_bounces": (65,)}, "max_bounces must be a whole number from 0 to 64, not 65"),
        ({"lamp_choices": ("nearest", "power")}, "unknown lamp choice 'nearest'"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_one_line(knobs, message):
    with pytest.raises(tt.InputError, match=message):
        variants.plan(**knobs)
