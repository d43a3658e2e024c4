"""The study of accuracy: its arithmetic by hand, and a small one from end to end."""

import itertools
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.picture.error_estimate import RelativeError
from taichi_tracer.sampler import DEFAULT_SAMPLER
from taichi_tracer.studies import accuracy_chart, accuracy_report, accuracy_tables, convergence, schedule, variants
from taichi_tracer.studies.convergence import Block, Curve, Study, Truth
from taichi_tracer.studies.variants import Variant


def curve(power=-0.5, scale=1.0, per_sample=0.01, variant=None, k=7):
    samples = 2 ** np.arange(1, k + 1)
    errors = np.tile(scale * (samples * per_sample) ** power, (3, 1))
    blocks = [Block(turn, 16, 16 * per_sample) for turn in range(5)]
    return Curve(variant or Variant(), 1.0, samples, errors, errors.copy(), blocks, shift_error=0.001)


def study(*curves):
    for c in curves:
        c.image, c.image_error = np.ones((8, 8, 3)), 0.0
        c.image[2, 3] = 1.1
    truth = RelativeError(0.001, 0.0009, 0.0011)
    return Study("x", (8, 8), "", 3, 0.1, list(curves), {"nearest": np.ones((8, 8, 3))}, truth, 100, 1.0)


def test_seconds_to_an_error_are_measured_or_unknown():
    """Between two pictures that were measured; what was not reached is not extrapolated."""
    c = curve(-0.5, scale=0.02)
    assert c.slope == pytest.approx(-0.5)
    assert c.seconds_to(0.05) == pytest.approx(0.16)
    assert c.seconds_to(0.5) == pytest.approx(0.02)
    assert math.isnan(c.seconds_to(0.002))
    assert c.last == (pytest.approx(1.28), pytest.approx(0.02 * 1.28**-0.5))
    assert c.milliseconds_per_sample == pytest.approx(10)
    assert c.variance_times_time == pytest.approx(0.02**2)


def test_an_error_that_rises_again_was_not_reached_before():
    c = curve()
    c.errors = np.tile([0.5, 0.04, 0.04, 3.0, 1.0, 0.2, 0.04], (3, 1))
    assert c.seconds_to(0.05) == pytest.approx(0.64 * 2 ** (math.log(0.2 / 0.05) / math.log(0.2 / 0.04)))
    c.errors[:, -1] = 0.2
    assert math.isnan(c.seconds_to(0.05))


def test_a_seed_that_went_farther_alone_counts_where_it_was():
    c = curve(scale=0.1)
    c.errors[1:, -2:] = np.nan
    assert np.isfinite(c.mean_errors).all()
    assert c.mean_errors[-1] == c.errors[0, -1]


def test_the_time_of_a_sample_is_the_median_over_blocks_and_noise_is_called_noise():
    a, b = curve(), curve(per_sample=0.02, variant=Variant(fast_math=True))
    a.blocks[2] = Block(2, 16, 16.0)  # another program, for a moment
    assert a.milliseconds_per_sample == pytest.approx(10)
    assert convergence.time_ratio(a, b)[0] == pytest.approx(2)
    rng = np.random.default_rng(1)
    noisy = [Block(t, 16, 0.16 * math.exp(rng.normal(0, 0.4))) for t in range(6)]
    b.blocks = noisy
    ratio, low, high = convergence.time_ratio(curve(), b)
    assert low < 1 < high
    assert accuracy_tables.is_noise(ratio, low, high)
    sentences = accuracy_tables.summary(study(curve(), b))
    assert any(s.startswith("Fast math: no difference in time can be told from noise") for s in sentences)


def test_blocks_of_one_turn_are_compared_with_each_other():
    """A machine that gets twice as slow in the middle changes no ratio."""
    load = [1, 1, 1, 2, 2, 2]
    a, b = curve(), curve(variant=Variant(precision="f64"))
    a.blocks = [Block(t, 16, 0.16 * f) for t, f in enumerate(load)]
    b.blocks = [Block(t, 16, 0.20 * f) for t, f in enumerate(load)]
    ratio, low, high = convergence.time_ratio(a, b)
    assert (ratio, low, high) == (pytest.approx(1.25),) * 3
    assert a.time_factor > 1.3


def test_knobs_are_compared_at_equal_samples():
    other = curve(scale=0.05, per_sample=0.02, variant=Variant(sampler="independent"), k=5)
    (row,) = accuracy_tables.knob_table(study(curve(scale=0.1), other))
    assert (row["knob"], row["from"], row["to"]) == ("sampler", DEFAULT_SAMPLER, "independent")
    assert row["time"] == pytest.approx(2)
    assert row["error"] == pytest.approx(0.5 / math.sqrt(2))
    sentences = accuracy_tables.summary(study(curve(scale=0.1), other))
    assert sentences[0].startswith("No variant reached 2 % within the 60 s of the study: ")
    assert any(s.endswith("lies in 1 of 64 pixels.") for s in sentences)


def test_errors_with_unseen_light_are_not_compared():
    """Unless the pictures are alike: then a knob changes nothing, whatever is missing."""
    first, other = curve(scale=0.1), curve(scale=0.02, variant=Variant(sampler="independent"))
    first.unseen = 5.0
    (row,) = accuracy_tables.knob_table(study(first, other))
    assert math.isnan(row["error"])
    told = "What independent numbers bring is unknown: light that no sample met may outweigh it."
    assert told in accuracy_tables.summary(study(first, other))
    same = curve(scale=0.1, variant=Variant(precision="f64"))
    (row,) = accuracy_tables.knob_table(study(first, same))
    assert row["error"] == pytest.approx(1)


def test_the_ticks_of_an_axis_have_room():
    """1 is always named, and others beside it where there is room."""
    from matplotlib.figure import Figure

    for width in (1.2, 3.0, 12.0):
        axes = Figure(figsize=(width, 2)).add_axes((0, 0, 1, 1))
        axes.set_xscale("log")
        axes.set_xlim(0.12, 4.6)
        accuracy_chart.set_ticks(axes.xaxis, 0.12, 4.6, str)
        ticks = axes.xaxis.get_majorticklocs()
        assert 1 in ticks
        assert len(ticks) >= (1 if width < 2 else 2)


def test_the_references_own_error_is_taken_off():
    assert convergence.error_beyond(0.05, 0.03) == pytest.approx(0.04)
    assert math.isnan(convergence.error_beyond(0.031, 0.03))
    assert convergence.error_beyond(0.0, 0.0) == 0


def test_bias_is_found_and_none_is_not_invented(rng):
    """z-scores of 40 unbiased sets of pictures have a spread of 1 (p < 1e-4 outside); a shift of 10 errors is seen."""
    truth = Truth(np.ones((32, 32, 3)), RelativeError(0, 0, 0), np.zeros((32, 32, 3)), 1)

    def pictures(shift):
        noise = np.repeat(rng.normal(size=(3, 32, 32, 1)), 3, axis=3)
        return [(1 + shift + 0.1 * n, np.full((32, 32, 3), 0.01)) for n in noise]

    found = np.array([convergence.shift_of(pictures(0), truth) for _ in range(40)])
    assert 0.6 < np.std(found[:, 0] / found[:, 1]) < 1.5
    assert 0.5 < np.std(found[:, 2]) < 1.5
    shift, error, z = convergence.shift_of(pictures(10 * 0.1 / math.sqrt(3 * 1024)), truth)
    assert shift > 5 * error
    assert z > 5
    assert shift == pytest.approx(10 * 0.1 / math.sqrt(3 * 1024), rel=0.4)


def test_one_pixel_with_a_rare_light_is_no_bias(rng):
    """A sun in a mirror that the reference has met, and the pictures have not, shifts the whole mean, not the z."""
    image = np.ones((32, 32, 3))
    image[4, 5] = 1e6
    truth = Truth(image, RelativeError(0, 0, 0), np.zeros((32, 32, 3)), 1)
    finals = []
    for _ in range(3):
        picture = 1 + 0.1 * np.repeat(rng.normal(size=(32, 32, 1)), 3, axis=2)
        finals.append((picture, np.full((32, 32, 3), 0.01)))
    shift, error, z = convergence.shift_of(finals, truth)
    assert abs(shift) > 100 * error
    assert abs(z) < 4
    assert convergence.shift_of(finals, truth, unseen=2.0)[1] > 2


def test_a_light_that_is_hardly_met_is_told():
    truth = np.full((32, 32, 3), 10.0)
    picture = np.ones((32, 32, 3))
    picture[3, 4] = picture[9, 9] = 5000
    assert convergence.unmet_light(picture, truth) == (2, 1024)
    assert convergence.unmet_light(truth * 1.3, truth) is None
    c = curve(variant=Variant("uniform"))
    c.unmet = (2, 1024)
    told = "uniform, niederreiter met the light in 2 of the 1,024 pixels where it is rare: its error is unknown."
    assert told in accuracy_tables.summary(study(c))


def test_every_pixel_is_in_the_error():
    image = np.ones((10, 10, 3))
    image[4, 5] = 1e6
    truth = Truth(image, RelativeError(0, 0, 0), np.zeros((10, 10, 3)), 1)
    wrong = image.copy()
    wrong[4, 5] = 0
    assert truth.error_of(wrong) == pytest.approx(1e6 / 10 / image.mean())


def test_where_the_reference_is_no_better_a_picture_tells_its_own_error():
    truth = Truth(np.ones((8, 8, 3)), RelativeError(0.1, 0.1, 0.1), np.zeros((8, 8, 3)), 1)
    assert convergence.error_of(np.full((8, 8, 3), 1.12), 0.05, truth) == 0.05
    assert convergence.error_of(np.full((8, 8, 3), 1.5), 0.05, truth) == pytest.approx(math.sqrt(0.5**2 - 0.1**2))


def test_a_reference_of_fewer_pixels_is_the_mean_of_blocks(rng):
    image = rng.random((6, 8, 3))
    truth = Truth(image, RelativeError(0.1, 0.09, 0.11), np.full((6, 8, 3), 0.04), 1)
    half = convergence.scaled(truth, 0.5)
    np.testing.assert_allclose(half.image[1, 2], image[2:4, 4:6].mean(axis=(0, 1)))
    assert half.error == pytest.approx(0.05)
    assert convergence.scaled(truth, 1.0) is truth


def test_bounces_have_their_bias_beside_their_noise_and_time():
    """Of a curve that misses 20 % of the light: no error below that is promised, whatever its slope."""
    variants_ = [Variant("path", max_bounces=k) for k in (8, 1, 3)]
    whole, direct, short = (curve(scale=0.02, per_sample=0.01 * v.max_bounces, variant=v) for v in variants_)
    direct.shift, short.shift = -0.2, -0.001
    direct.is_biased = short.is_biased = True
    direct.noise *= 0.5
    rows = accuracy_tables.bounce_table(study(whole, direct, short))
    assert [row["bounces"] for row in rows] == [1, 3, 8]
    assert [row["missing light"] for row in rows] == [0.2, 0.001, 0]
    assert rows[0]["time"] == pytest.approx(1 / 8)
    assert rows[0]["mean"] == pytest.approx(0.8)
    assert rows[0]["noise at 128 spp"] == pytest.approx(direct.noise[0, -1])
    sentences = accuracy_tables.summary(study(whole, direct, short))
    assert any(s.startswith("Paths of at most 1 bounce miss 20 % of the light") for s in sentences)
    assert "From 3 bounces on, what is missing cannot be told from its standard error." in sentences
    assert {r["knob"] for r in accuracy_tables.knob_table(study(whole, direct, short))} == set()


def test_efficiency_is_one_over_variance_times_seconds():
    none, roulette = (curve(scale=0.02, variant=Variant("path", roulette=r)) for r in ("none", 0.5))
    roulette.noise *= 1.5
    roulette.blocks = [Block(b.turn, b.samples, b.seconds / 3) for b in roulette.blocks]
    first, second = accuracy_tables.efficiency_of(study(none, roulette), "roulette")
    assert (first["roulette"], first["efficiency"]) == ("no roulette", 1)
    assert second["efficiency"] == pytest.approx(3 / 1.5**2)
    assert accuracy_tables.efficiency_of(study(none, roulette), "lamp_choice") == []
    told = accuracy_tables.summary(study(none, roulette))
    assert "Roulette q = 0.5 is 1.33 times as efficient as no roulette." in told
    page = accuracy_report.tables_of_questions(study(none, roulette))
    assert list(page) == ["What roulette saves"]
    assert "<td>1.33</td>" in page["What roulette saves"]


def test_a_time_that_is_hardly_longer_is_not_once_as_long():
    told = [accuracy_tables.times_as_long(ratio) for ratio in (1.0, 1.04, 1.2, 3.14, 12.3, 1234.5)]
    assert told[:2] == ["about as long"] * 2
    assert told[2:] == [f"{ratio} times as long" for ratio in ("1.2", "3.1", "12", "1,234")]


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
    rows = accuracy_tables.knob_table(study(*(curve(variant=v) for v in plan)))
    assert ("plain", "fast forms", "plain forms") in [(r["knob"], r["from"], r["to"]) for r in rows]


@pytest.fixture
def steps(monkeypatch):
    """A clock for the schedule that counts how often it is asked: a study is as long on every machine."""
    ticks = itertools.count()
    monkeypatch.setattr(schedule, "time", SimpleNamespace(perf_counter=lambda: 0.6 * next(ticks)))
    monkeypatch.setattr(schedule, "CHUNK", 0.01)


@pytest.mark.exhaustive
def test_a_small_study_of_bounces_finds_what_is_missing(tmp_path, steps):
    """In the white room, k bounces miss (3/4)^(k+1) of the light; the reference with 8 bounces misses (3/4)^9."""
    start("f32")
    room = tt.load_scene_data("white_room")
    table, _ = tt.studies.accuracy(room, size=(16, 16), budget=120, seeds=2, report=tmp_path, max_bounces=(0, 2, 8))
    assert list(table["variant"]) == [
        "path, niederreiter, 8 bounces",
        "path, niederreiter, 2 bounces",
        "path, niederreiter, 0 bounces",
    ]
    content = json.loads((tmp_path / "accuracy.json").read_text())
    assert content["scene"] == "white_room, lit by its lamps"
    assert content["reference"]["max_bounces"] == 8
    for row in content["bounces"]:
        exact = 1 - (1 - 0.75 ** (row["bounces"] + 1)) / (1 - 0.75**9)
        assert abs(row["missing light"] - exact) < 4 * row["standard error"] + 1e-5
    assert "What bounces bring" in (tmp_path / "accuracy.html").read_text(encoding="utf-8")
    cube = tt.load_scene_data("cube")
    with pytest.raises(tt.InputError, match="has no surface with Ke > 0"):
        tt.studies.accuracy(cube, size=(8, 8), budget=60, lamp_choices=("area", "power"))
    with pytest.raises(tt.InputError, match="has no light: give an environment"):
        tt.studies.accuracy(cube, "none", size=(8, 8), budget=60)


@pytest.mark.exhaustive
def test_a_small_study_of_a_loaded_scene(tmp_path, steps):
    start("f32")
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    knobs = {"estimators": ("uniform", "mis"), "adaptive": (False,), "scales": (1.0,), "lookups": ("nearest",)}
    knobs |= {"triangle_tests": ("moller_trumbore",), "forms": ("fast",)}
    result = tt.studies.accuracy(scene, size=(24, 24), budget=120, seeds=2, report=tmp_path, **knobs)
    table, figure = result
    assert list(table["variant"]) == [
        f"{estimator}, {sampler}, moller_trumbore"
        for estimator in ("mis", "uniform")
        for sampler in ("niederreiter", "independent")
    ]
    assert len(figure.axes) == 3
    assert {p.name for p in tmp_path.iterdir()} == set(accuracy_report.FILES)
    page = (tmp_path / "accuracy.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert "http" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    ).replace("https://matplotlib.org", ""), "the page needs no other file"
    content = json.loads((tmp_path / "accuracy.json").read_text())
    by_name = {row["variant"]: row for row in content["costs"]}
    assert {(row["estimator"], row["seed"]) for row in content["measurements"]} >= {
        (estimator, seed) for estimator in ("uniform", "mis") for seed in (1, 2)
    }
    for row in content["measurements"]:
        assert row["seconds"] > 0
        assert row["relative_rmse"] > 0
    assert abs(by_name["mis, independent, moller_trumbore"]["bias z"]) < 5
    lines = (tmp_path / "accuracy.csv").read_text().splitlines()
    assert len(lines) == 1 + len(content["measurements"])
    with pytest.raises(tt.InputError, match="give its name or path instead"):
        tt.studies.accuracy(scene, size=(8, 8), budget=1, precisions=("f32", "f64"))
