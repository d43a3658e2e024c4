"""Small studies of accuracy from end to end."""

import itertools
import json
from types import SimpleNamespace

import pytest
from support import start

import taichi_tracer as tt
from taichi_tracer.studies import accuracy_report, budget, schedule


@pytest.fixture
def steps(monkeypatch):
    """A clock for the schedule that counts how often it is asked: a study is as long on every machine."""
    ticks = itertools.count()
    monkeypatch.setattr(budget, "time", SimpleNamespace(perf_counter=lambda: 0.6 * next(ticks)))
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
        for sampler in ("niederreiter", "niederreiter_two", "independent")
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
        ("uniform", 1),
        ("mis", 1),
        ("mis", 2),
    }  # the leader has a third of the budget, so that others may have fewer seeds than were ordered
    for row in content["measurements"]:
        assert row["seconds"] > 0
        assert row["relative_rmse"] > 0
    assert abs(by_name["mis, independent, moller_trumbore"]["bias z"]) < 5
    lines = (tmp_path / "accuracy.csv").read_text().splitlines()
    assert len(lines) == 1 + len(content["measurements"])
    with pytest.raises(tt.InputError, match="give its name or path instead"):
        tt.studies.accuracy(scene, size=(8, 8), budget=1, precisions=("f32", "f64"))


@pytest.mark.exhaustive
def test_a_study_of_a_name_leaves_the_scenes_of_the_caller_alone():
    start("f32")
    scene = tt.load_scene_data("cube", environment="studio", intersector="brute_force")
    renderer = tt.A2Renderer(scene, 16, 16).use("mis").render(2)
    knobs = {"estimators": ("mis",), "samplers": ("niederreiter",), "precisions": ("f64",), "fast_math": (False,)}
    knobs |= {"triangle_tests": ("watertight",), "lookups": ("nearest",), "adaptive": (False,), "scales": (1.0,)}
    table, figure = tt.studies.accuracy("cube", size=(16, 16), budget=40, seeds=1, forms=("fast",), **knobs)
    assert list(table["variant"]) == ["mis, niederreiter, f64"]
    assert table["best error"][0] > 0
    assert len(figure.axes) == 2
    assert renderer.render(2).samples == 4
