"""Tables and sentences of a study: what a knob changes, what bounces and roulette bring, and what is only noise."""

import math

import numpy as np
import pytest
from made_up_study import made_curve, made_study

from taichi_tracer.studies import accuracy_report, accuracy_tables, convergence
from taichi_tracer.studies.convergence import Block
from taichi_tracer.studies.variants import Variant


def noisier(curve, factor):
    """What was found, where each picture tells another error of itself."""
    return {seed: {n: (e, factor * told) for n, (e, told) in own.items()} for seed, own in curve.found.items()}


def test_the_time_of_a_sample_is_the_median_over_blocks_and_noise_is_called_noise():
    a, b = made_curve(), made_curve(per_sample=0.02, variant=Variant(fast_math=True))
    a.blocks[2] = Block(2, 16, 16.0)  # another program, for a moment
    assert a.milliseconds_per_sample == pytest.approx(10)
    assert convergence.time_ratio(a, b)[0] == pytest.approx(2)
    rng = np.random.default_rng(1)
    noisy = [Block(t, 16, 0.16 * math.exp(rng.normal(0, 0.4))) for t in range(6)]
    b.blocks = noisy
    ratio, low, high = convergence.time_ratio(made_curve(), b)
    assert low < 1 < high
    assert accuracy_tables.is_noise(ratio, low, high)
    sentences = accuracy_tables.summary(made_study(made_curve(), b))
    assert any(s.startswith("Fast math: no difference in time can be told from noise") for s in sentences)


def test_errors_with_unseen_light_are_not_compared():
    """Unless the pictures are alike: then a knob changes nothing, whatever is missing."""
    first, other = made_curve(scale=0.1), made_curve(scale=0.02, variant=Variant(sampler="independent"))
    first.unseen = 5.0
    (row,) = accuracy_tables.knob_table(made_study(first, other))
    assert math.isnan(row["error"])
    told = "What independent numbers bring is unknown: light that no sample met may outweigh it."
    assert told in accuracy_tables.summary(made_study(first, other))
    other.unseen = 5.0
    assert accuracy_tables.summary(made_study(first, other))[0].endswith("; light that no sample met may add 500 %.")
    same = made_curve(scale=0.1, variant=Variant(precision="f64"))
    (row,) = accuracy_tables.knob_table(made_study(first, same))
    assert row["error"] == pytest.approx(1)


def test_efficiency_is_one_over_variance_times_seconds():
    none, roulette = (made_curve(scale=0.02, variant=Variant("path", roulette=r)) for r in ("none", 0.5))
    roulette.found = noisier(roulette, 1.5)
    roulette.blocks = [Block(b.turn, b.samples, b.seconds / 3) for b in roulette.blocks]
    first, second = accuracy_tables.questions(made_study(none, roulette))["roulette"]
    assert (first["roulette"], first["efficiency"]) == ("no roulette", 1)
    assert second["efficiency"] == pytest.approx(3 / 1.5**2)
    assert accuracy_tables.questions(made_study(none, roulette))["lamp_choice"] == []
    told = accuracy_tables.summary(made_study(none, roulette))
    assert "Roulette q = 0.5 is 1.33 times as efficient as no roulette." in told
    page = accuracy_report.as_html(made_study(none, roulette))
    assert "<h2>What roulette saves</h2>" in page
    assert "<h2>Which lamp?</h2>" not in page
    assert ">1.33</td>" in page
