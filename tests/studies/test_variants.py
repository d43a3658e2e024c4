"""What a study compares: every knob turned alone, and nothing that cannot be compared."""

import pytest
from made_up_study import made_curve, made_study

import taichi_tracer as tt
from taichi_tracer.studies import accuracy_tables, variants
from taichi_tracer.studies.variants import Variant


def test_plans():
    plan = variants.plan(estimators=("brdf", "mis"), samplers=("niederreiter",), fast_math=(False,), scales=(1.0,))
    assert [v.label for v in plan] == [
        "mis, niederreiter",
        "brdf, niederreiter",
        "mis, niederreiter, f64",
        "mis, niederreiter, moller_trumbore",
        "mis, niederreiter, bilinear",
        "mis, niederreiter, adaptive",
        "mis, niederreiter, plain forms",
    ]
    everything = variants.plan(every=True)
    assert len(everything) == len(set(everything)) == 8 * 3 * 2**5
    with pytest.raises(tt.InputError, match="unknown sampler 'halton'"):
        variants.plan(samplers=("halton",))
    with pytest.raises(tt.InputError, match="unknown form 'simple'"):
        variants.plan(forms=("simple",))


def test_a_question_of_paths_is_turned_alone():
    plan = variants.plan(max_bounces=(1, 16, 5), roulettes=("none", 0.2), rr_start_bounce=1)
    assert [v.label for v in plan] == [
        "path, niederreiter, 16 bounces",
        "path, niederreiter, 5 bounces",
        "path, niederreiter, 1 bounce",
        "path, niederreiter, 16 bounces, roulette q = 0.2, after bounce 1",
    ]
    assert plan[0].paths == {
        "max_bounces": 16, "rr_start_bounce": 1, "roulette": "course", "rr_termination_probability": 0.0
    }  # fmt: skip
    assert plan[3].paths["rr_termination_probability"] == 0.2
    assert Variant("path", roulette="throughput").paths["roulette"] == "throughput"
    assert [v.setting("lamp_choice") for v in variants.plan(lamp_choices=("power", "area"))] == [
        "lamps by power", "lamps by area"
    ]  # fmt: skip
    assert [v.estimator for v in variants.plan(max_bounces=(3,), samplers=("niederreiter",))[:3]] == [
        "path",
        "implicit",
        "explicit",
    ]


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


def test_forms_and_intersectors_are_knobs_that_are_turned_on_request():
    only = {"estimators": ("mis",), "samplers": ("niederreiter",), "precisions": ("f32",), "fast_math": (False,)}
    only |= {"triangle_tests": ("watertight",), "lookups": ("nearest",), "adaptive": (False,), "scales": (1.0,)}
    plan = variants.plan(**only, forms=("fast", "plain"), intersectors=("bvh", "brute_force"))
    assert [v.label for v in plan] == [
        "mis, niederreiter, bvh",
        "mis, niederreiter, brute_force",
        "mis, niederreiter, bvh, plain forms",
    ]
    assert [v.plain for v in plan] == [False, False, True]
    assert not any(v.plain for v in variants.plan(every=True))
    rows = accuracy_tables.knob_table(made_study(*(made_curve(variant=v) for v in plan)))
    assert ("plain", "fast forms", "plain forms") in [(r["knob"], r["from"], r["to"]) for r in rows]
