"""What a study compares: every knob turned alone, and nothing that cannot be compared."""

import pytest

import taichi_tracer as tt
from taichi_tracer.studies import variants


def test_plans():
    plan = variants.plan(estimators=("brdf", "mis"), samplers=("niederreiter",), fast_math=(False,), scales=(1.0,))
    assert [v.label for v in plan] == [
        "mis, niederreiter",
        "brdf, niederreiter",
        "mis, niederreiter, f64",
        "mis, niederreiter, moller_trumbore",
        "mis, niederreiter, bilinear",
        "mis, niederreiter, adaptive",
    ]
    everything = variants.plan(every=True)
    assert len(everything) == len(set(everything)) == 8 * 3 * 2**5
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
