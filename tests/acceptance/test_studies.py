"""What the package says of its own pictures: errors, the study of accuracy, hard cases, the receipt, explanations."""

import csv
import json

import numpy as np
import pytest
from acceptance.command import command

import taichi_tracer as tt

SEEDS = 24
SCENES = {
    "specular_spheres": "studio",
    "cornell_box": None,
    "cube": "white",
    "torus_knot": "sunny",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_the_interval_of_the_error_has_the_true_error(name):
    """95 of 100 do. Fewer than 18 of 24 have a probability of 2e-5 then."""
    scene = tt.load_scene_data(name, environment=SCENES[name])
    renderer = tt.A3Renderer(scene, 24, 24, seed=999).use("mis")
    truth = np.asarray(renderer.render(2048).image(), float)
    inside = 0
    for seed in range(SEEDS):
        renderer.seed = seed
        renderer.reset()
        right = np.sqrt(((np.asarray(renderer.render(32).image(), float) - truth) ** 2).mean()) / truth.mean()
        inside += renderer.error().low <= right <= renderer.error().high
    assert inside >= 18


def test_a_picture_ends_at_the_error_that_is_asked_for():
    scene = tt.load_scene_data("cube", environment="white", intersector="brute_force")
    renderer = tt.A2Renderer(scene_data=scene, width=16, height=16).use("mis").render(error=0.05)
    assert renderer.error() <= 0.05
    assert renderer.error().low <= renderer.error() <= renderer.error().high
    assert renderer.error_image().shape == (16, 16, 3)


@pytest.mark.slow
def test_the_errors_of_a_study_fall(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["--estimators", "uniform,mis", "--samplers", "independent", "--precisions", "f32", "--fast-math", "off"]
    words += ["--triangle-tests", "watertight", "--lookups", "nearest", "--size", "16", "--arch", "cpu"]
    assert command("accuracy", "cube", *words, "--budget", "8", "--report", "out") == 0
    (file,) = (tmp_path / "out").glob("*.csv")
    rows = list(csv.DictReader(file.open()))
    assert {"estimator", "sampler", "seed", "samples", "seconds", "relative_rmse"} <= set(rows[0])
    for estimator in ("uniform", "mis"):
        found = {}
        for row in rows:
            if row["estimator"] == estimator and row["adaptive"] == "False":
                found.setdefault(int(row["samples"]), []).append(float(row["relative_rmse"]))
        assert len(found) >= 3
        assert np.mean(found[max(found)]) < 0.6 * np.mean(found[min(found)]), estimator


@pytest.mark.slow
def test_no_hard_case_fails_in_the_default_mode(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert command("hardcases", "--quick", "--arch", "cpu", "--json", "hard.json") == 0
    text = capfd.readouterr().out
    assert "PASS" in text
    assert "FAIL" not in text
    assert text.startswith("The default (watertight f32 wide_bvh) passes 35 of 35 cases; other modes")
    assert json.loads((tmp_path / "hard.json").read_text())


def test_the_receipt_says_what_is_compiled_and_what_is_left_out(capsys):
    plain = tt.load_scene_data("cube", environment="white")
    renderer = tt.A2Renderer(scene_data=plain, width=8, height=8).use("mis")
    assert command("info", "cube", "--environment", "white", "--arch", "cpu") == 0
    told = capsys.readouterr().out
    assert "triangles" in told
    everything = tt.load_scene_data("cube", environment="white", effects="all")
    other = tt.A2Renderer(scene_data=everything, width=8, height=8).use("mis")
    assert all(isinstance(line, str) for line in renderer.receipt())
    assert renderer.receipt() != other.receipt()
    assert any("not simulated" in line for line in renderer.receipt())
    paths = tt.A4Renderer(scene_data=plain, width=8, height=8)
    paths.max_bounces = 3
    assert any("3" in line and "bounce" in line for line in paths.receipt())


@pytest.mark.slow
def test_an_explanation_adds_up_to_the_pixel(capsys, tmp_path):
    words = ["explain", "cube", "--environment", "studio", "--estimator", "brdf", "--size", "16x16", "--spp", "2"]
    assert command(*words, "--pixel", "8", "8", "--arch", "cpu", "--json", tmp_path / "x.json") == 0
    assert "pixel" in capsys.readouterr().out
    assert json.loads((tmp_path / "x.json").read_text())
    scene = tt.load_scene_data("cube", environment="studio")
    renderer = tt.A2Renderer(scene_data=scene, width=16, height=16).use("brdf").render(1)
    assert len(str(renderer.explain(8, 8))) > 100


def test_two_pictures_are_compared(capsys, tmp_path):
    one = np.random.default_rng(1).uniform(0.5, 1, (16, 16, 3)).astype(np.float32)
    tt.save_image(tmp_path / "a.npy", one)
    tt.save_image(tmp_path / "b.npy", 1.1 * one)
    assert command("compare", tmp_path / "a.npy", tmp_path / "b.npy") == 0
    assert "%" in capsys.readouterr().out


@pytest.mark.slow
def test_samples_of_a_checkpoint_go_on(tmp_path, monkeypatch):
    """Four samples and four more are the picture of eight; and two halves are merged to the same."""
    monkeypatch.chdir(tmp_path)
    words = ["render", "cube", "--estimator", "brdf", "--size", "12x12", "--arch", "cpu"]
    assert command(*words, "--spp", 8, "-o", "whole.npy") == 0
    for spp in (4, 8):
        assert command(*words, "--spp", spp, "--checkpoint", "k", "-o", "part.npy") == 0
    assert np.allclose(np.load("part.npy"), np.load("whole.npy"), rtol=1e-5)
    for first in (0, 4):
        range_ = ["--first-sample", first, "--spp", 4, "--checkpoint", f"{first}.k"]
        assert command(*words, *range_, "-o", "half.npy") == 0
    assert command("merge", "0.k", "4.k", "-o", "merged.npy") == 0
    assert np.allclose(np.load("merged.npy"), np.load("whole.npy"), rtol=1e-5)
